// SPDX-License-Identifier: Apache-2.0
#include "map/three_level_map.h"

#include <limits>

#include <gtest/gtest.h>

#include "map/map_oracle.h"
#include "map/random_clouds.h"

namespace ignis {
namespace {

using test::oracle_levels;
using test::pose_at;
using test::random_cloud;

/// Clouds in a store, as LiveMap keeps them, and the map of them.
struct World {
  MapConfig config;
  std::map<std::int32_t, std::vector<CloudPoint>> store;
  ThreeLevelMap map{config};

  explicit World(const MapConfig& c = {}) : config(c), map(c) {}

  [[nodiscard]] ThreeLevelMap::CloudLookup lookup() const {
    return [this](std::int32_t id) { return StoredCloud{store.at(id), {}, {}}; };
  }
  InsertCounts add(std::int32_t id, std::vector<CloudPoint> points, const Pose& pose) {
    store[id] = std::move(points);
    map.add_cloud(id, pose);
    return map.insert(id, store[id]);
  }
  [[nodiscard]] RebuildJob job() const {
    RebuildJob job{.config = config,
                   .clouds = {},
                   .centre = map.windows().centre,
                   .coarsening = map.coarsening(),
                   .open_cloud = {}};
    for (const auto& [id, points] : store) {
      job.clouds.push_back({id, std::make_shared<const CloudData>(CloudData{points, {}, {}}), map.pose(id)});
    }
    return job;
  }
};

void expect_equals_oracle(const World& world) {
  const auto levels = oracle_levels(world.job());
  for (std::size_t i = 0; i < kLevels; ++i) {
    const auto voxels = world.map.sorted(i);
    ASSERT_EQ(voxels.size(), levels[i].size()) << "level " << i;
    auto expected = levels[i].begin();
    for (const auto& [cell, point] : voxels) {
      ASSERT_EQ(cell, expected->first);
      const Eigen::Vector3d centre = test::cell_centre(cell, world.map.grid().cell_m[i]);
      EXPECT_EQ(point.p_world, centre + expected->second.from_centre.cast<double>());
      EXPECT_EQ(point.keyframe_id, expected->second.keyframe_id);
      EXPECT_EQ(point.intensity, expected->second.intensity);
      ++expected;
    }
  }
}

World random_world(std::uint32_t seed, int clouds, std::size_t points) {
  std::mt19937 generator(seed);
  World world;
  world.map.place_windows({5.0, 0.5, -3.0});
  for (int id = 0; id < clouds; ++id) {
    const auto along = static_cast<double>(generator() % 60);
    world.add(id, random_cloud(generator, points, 14.0, 6.0), pose_at(along - 30.0, 0.02 * id, -0.5 * along, 0.3 * id));
  }
  return world;
}

TEST(ThreeLevelMap, HoldsOnEveryLevelThePointNearestTheCentreOfEveryCellInItsWindow) {
  const World world = random_world(1, 8, 3'000);
  for (std::size_t i = 0; i < kLevels; ++i) EXPECT_GT(world.map.sorted(i).size(), 100U);
  expect_equals_oracle(world);
}

TEST(ThreeLevelMap, DoesNotDependOnTheOrderOfInsertion) {
  World world = random_world(2, 6, 2'000);
  World other;
  other.map.place_windows(world.map.windows().centre);
  for (auto cloud = world.store.rbegin(); cloud != world.store.rend(); ++cloud) {
    std::vector<CloudPoint> reversed(cloud->second.rbegin(), cloud->second.rend());
    other.add(cloud->first, std::move(reversed), world.map.pose(cloud->first));
  }
  EXPECT_EQ(world.map.fingerprint(), other.map.fingerprint());
}

TEST(ThreeLevelMap, WindowsThatSlideAwayAndBackForgetAndFillAgain) {
  std::mt19937 generator(3);
  World world;
  for (int id = 0; id < 12; ++id) world.add(id, random_cloud(generator, 1'500, 12.0, 4.0), pose_at(4.0 * id, 0, 0));
  const auto follow = [&](double x) { world.map.follow({x, 0.1, 0.2}, world.lookup()); };
  follow(0.0);
  const std::string at_home = world.map.fingerprint();
  for (const double x : {3.0, 11.0, 25.0, 44.0, 140.0}) {
    follow(x);
    expect_equals_oracle(world);
  }
  EXPECT_EQ(world.map.sorted(1).size(), 0U) << "140 m away only the coarse level is left";
  EXPECT_GT(world.map.sorted(2).size(), 0U);
  follow(400.0);
  EXPECT_EQ(world.map.size(), 0U);
  follow(0.0);
  EXPECT_EQ(world.map.fingerprint(), at_home);
}

TEST(ThreeLevelMap, WindowsFollowInSteps) {
  World world;
  world.map.follow({0.1, 0.0, 0.0}, world.lookup());
  EXPECT_EQ(world.map.windows().centre, Eigen::Vector3d::Zero());
  world.map.follow({0.37, 0.0, 0.0}, world.lookup());
  EXPECT_EQ(world.map.windows().centre, Eigen::Vector3d::Zero()) << "0.37 of a step of 0.5 m";
  world.map.follow({0.38, 0.0, 0.0}, world.lookup());
  EXPECT_EQ(world.map.windows().centre, Eigen::Vector3d(0.5, 0.0, 0.0));
  world.map.follow({0.2, 0.0, -0.3}, world.lookup());
  EXPECT_EQ(world.map.windows().centre, Eigen::Vector3d(0.5, 0.0, 0.0)) << "no way back at the first centimetre";
}

TEST(ThreeLevelMap, UpsamplingKeepsThePointNearestTheCentreOfTheLargerCell) {
  World world;
  world.map.place_windows({0, 0, 0});
  // Two local cells of one mid cell [0, 0.25)^3, whose centre is 0.125.
  world.add(0, {{{0.02F, 0.02F, 0.02F}, 1.0F}, {{0.20F, 0.13F, 0.12F}, 2.0F}}, Pose{});
  EXPECT_EQ(world.map.sorted(0).size(), 2U);
  world.map.follow({20, 0, 0}, world.lookup());
  EXPECT_EQ(world.map.sorted(0).size(), 0U);
  ASSERT_EQ(world.map.sorted(1).size(), 1U);
  EXPECT_FLOAT_EQ(world.map.find(1, {0, 0, 0})->intensity, 2.0F);
}

TEST(ThreeLevelMap, MovedCloudsLeaveNothingBehind) {
  std::mt19937 generator(4);
  World world = random_world(5, 8, 2'000);
  const std::vector<std::pair<std::int32_t, Pose>> moved = {{2, pose_at(3, 0.4, 1, 2.0)}, {5, pose_at(-9, 0, 7, -1.0)}};
  world.map.move_clouds(moved, world.lookup());
  expect_equals_oracle(world);
  EXPECT_EQ(world.map.pose(2).translation, moved[0].second.translation);
  // Far beyond all windows, and back.
  const std::vector<std::pair<std::int32_t, Pose>> away = {{2, pose_at(2'000, 0, 0)}};
  world.map.move_clouds(away, world.lookup());
  expect_equals_oracle(world);
  world.map.move_clouds(moved, world.lookup());
  expect_equals_oracle(world);
}

TEST(ThreeLevelMap, ARemovedCloudMakesRoomForTheOthersPoints) {
  World world = random_world(6, 6, 3'000);
  const std::size_t before = world.map.size();
  const std::vector<std::int32_t> ids = {1, 4};
  world.map.remove_clouds(ids, world.lookup());
  for (const std::int32_t id : ids) world.store.erase(id);
  EXPECT_FALSE(world.map.contains(4));
  EXPECT_LT(world.map.size(), before);
  expect_equals_oracle(world);
}

TEST(ThreeLevelMap, SizesAreThoseOfTheTables) {
  World world = random_world(7, 6, 3'000);
  const auto expect_sizes = [&] {
    std::array<std::size_t, kLevels> counted{};
    world.map.for_each_tile([&](const Tile& tile) {
      for (std::size_t i = 0; i < kLevels; ++i) counted[i] += tile.level(i).size();
    });
    for (std::size_t i = 0; i < kLevels; ++i) EXPECT_EQ(world.map.size(i), counted[i]);
  };
  expect_sizes();
  world.map.follow({30, 0, 5}, world.lookup());
  expect_sizes();
  const std::vector<std::pair<std::int32_t, Pose>> moved = {{2, pose_at(33, 0.4, 1, 2.0)}};
  world.map.move_clouds(moved, world.lookup());
  expect_sizes();
}

TEST(ThreeLevelMap, RefusesPointsThatItCannotHold) {
  World world;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const InsertCounts counts = world.add(0,
                                        {{{nan, 0.0F, 0.0F}, 1.0F},
                                         {{1e30F, 0.0F, 0.0F}, 1.0F},
                                         {{1.0F, 0.0F, 0.0F}, 1.0F},
                                         {{500.0F, 0.0F, 0.0F}, 1.0F}},
                                        Pose{});
  EXPECT_EQ(counts.rejected, 2U);
  EXPECT_EQ(counts.outside, 1U);
  EXPECT_EQ(counts.inserted, 1U);
  Pose crooked;
  crooked.rotation.w() = 2.0;
  for (const Pose& pose : {pose_at(1e7, 0, 0), pose_at(0, static_cast<double>(nan), 0), crooked}) {
    EXPECT_FALSE(usable(pose));
  }
  EXPECT_TRUE(usable(pose_at(-9'999, 3, 9'999, 1.0)));
}

TEST(ThreeLevelMap, StaysWithinItsBoundByCoarsening) {
  std::mt19937 generator(8);
  MapConfig config;
  config.max_voxels = 10'000;
  World world(config);
  for (int id = 0; id < 40; ++id) {
    world.add(id, random_cloud(generator, 1'000, 9.0, 4.0), pose_at(4.0 * id, 0, 0));
    world.map.follow({4.0 * id, 0, 0}, world.lookup());
    world.map.stay_within_bound(world.lookup());
    ASSERT_LE(world.map.size(), 10'000U);
  }
  EXPECT_GT(world.map.coarsening(), 2) << "two levels left out were not enough";
  EXPECT_GT(world.map.size(2), 1'000U);
  EXPECT_EQ(world.map.fingerprint(), rebuild(world.job()).fingerprint());
}

TEST(ThreeLevelMap, ReportsTheMemoryOfItsTables) {
  std::mt19937 generator(9);
  World world;
  EXPECT_LT(world.map.bytes(), 1'000U);
  world.add(0, random_cloud(generator, 50'000, 9.0, 4.0), Pose{});
  EXPECT_GE(world.map.bytes(), world.map.size() * 29);
  EXPECT_LE(world.map.bytes(), world.map.size() * 57 + 1'000'000);
}

}  // namespace
}  // namespace ignis
