// SPDX-License-Identifier: Apache-2.0
#include "map/three_level_map.h"

#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "map/random_clouds.h"

namespace ignis {
namespace {

using test::pose_at;
using test::random_cloud;

double horizontal(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::hypot(a.x() - b.x(), a.z() - b.z());
}

TEST(ThreeLevelMap, PutsAScanWithinTheLocalWindowIntoTheLocalLevelAlone) {
  std::mt19937 generator(1);
  ThreeLevelMap map(MapConfig{});
  const InsertCounts counts = map.insert(random_cloud(generator, 5'000, 9.9, 4.9), pose_at(3, 1, -2, 0.7));
  EXPECT_EQ(counts.inserted, 5'000U);
  EXPECT_GT(map.level(0).size(), 4'000U);
  EXPECT_EQ(map.level(1).size(), 0U);
  EXPECT_EQ(map.level(2).size(), 0U);
}

TEST(ThreeLevelMap, EveryPointInsideTheWindowsHasAVoxelOnTheLevelOfItsDistance) {
  std::mt19937 generator(2);
  const Pose pose = pose_at(5, 0, 5, -1.0);
  const std::vector<CloudPoint> cloud = random_cloud(generator, 20'000, 120.0, 6.0);
  ThreeLevelMap map(MapConfig{});
  const InsertCounts counts = map.insert(cloud, pose);
  std::size_t outside = 0;
  for (const CloudPoint& point : cloud) {
    const Eigen::Vector3d p = pose * Eigen::Vector3d(point.position.cast<double>());
    const double distance = horizontal(p, pose.translation);
    const std::size_t level = distance <= 10.0 ? 0 : distance <= 30.0 ? 1 : 2;
    if (distance > 100.0 || std::abs(p.y()) > 5.0) {
      ++outside;
    } else {
      EXPECT_TRUE(map.level(level).contains(map.level(level).cell_of(p)));
    }
  }
  EXPECT_EQ(counts.outside, outside);
  EXPECT_EQ(counts.inserted + outside, cloud.size());
}

TEST(ThreeLevelMap, LosesNothingInsideTheCoarseWindowWhileDrivingAndKeepsEachLevelInItsWindow) {
  std::mt19937 generator(3);
  MapConfig config;
  config.coarse_window_m = 40.0;
  ThreeLevelMap map(config);
  std::vector<Eigen::Vector3d> seen;
  for (int step = 0; step <= 60; ++step) {
    const Pose pose = pose_at(step, 0, 0.3 * step, 0.1 * step);
    for (const CloudPoint& point : random_cloud(generator, 200, 12.0, 4.0)) {
      map.insert(std::span(&point, 1), pose);
      seen.push_back(pose * Eigen::Vector3d(point.position.cast<double>()));
    }
  }
  const double windows[] = {config.local_window_m, config.mid_window_m, config.coarse_window_m};
  for (std::size_t i = 0; i < kLevels; ++i) {
    EXPECT_GT(map.level(i).size(), 0U);
    map.level(i).for_each([&](const CellIndex&, const MapPoint& point) {
      EXPECT_LE(horizontal(point.p_world, map.centre()), windows[i]);
    });
  }
  std::size_t forgotten = 0;
  for (const Eigen::Vector3d& p : seen) {
    bool found = false;
    for (std::size_t i = 0; i < kLevels; ++i) found = found || map.level(i).contains(map.level(i).cell_of(p));
    // A cell on the rim may go with its representative although this point of it still lies inside.
    if (horizontal(p, map.centre()) < config.coarse_window_m - 1.0) {
      EXPECT_TRUE(found) << p.transpose();
    }
    if (!found) ++forgotten;
  }
  EXPECT_GT(forgotten, 0U) << "the coarse window was never left";
}

TEST(ThreeLevelMap, UpsamplingKeepsThePointNearestTheCentreOfTheLargerCell) {
  MapConfig config;
  ThreeLevelMap map(config);
  // Two local cells of one mid cell [0, 0.25)^3, whose centre is 0.125.
  const std::vector<CloudPoint> cloud = {{{0.02F, 0.02F, 0.02F}, 1.0F}, {{0.20F, 0.13F, 0.12F}, 2.0F}};
  map.insert(cloud, pose_at(0, 0, 0));
  ASSERT_EQ(map.level(0).size(), 2U);
  map.insert({}, pose_at(12, 0, 0));
  EXPECT_EQ(map.level(0).size(), 0U);
  ASSERT_EQ(map.level(1).size(), 1U);
  EXPECT_FLOAT_EQ(map.level(1).find({0, 0, 0})->intensity, 2.0F);
}

TEST(ThreeLevelMap, ForgetsWhatLeavesTheHeightWindow) {
  ThreeLevelMap map(MapConfig{});
  const std::vector<CloudPoint> cloud = {{{1.0F, -4.0F, 1.0F}, 1.0F}, {{1.0F, 4.0F, 1.0F}, 1.0F}};
  map.insert(cloud, pose_at(0, 0, 0));
  map.insert({}, pose_at(0, 2, 0));
  EXPECT_EQ(map.size(), 1U);
  EXPECT_TRUE(map.level(0).contains(map.level(0).cell_of({1.0, 4.0, 1.0})));
}

TEST(ThreeLevelMap, RefusesUnusablePosesAndPointsWithoutAnyChange) {
  std::mt19937 generator(4);
  ThreeLevelMap map(MapConfig{});
  const std::vector<CloudPoint> cloud = random_cloud(generator, 500, 9.0, 4.0);
  map.insert(cloud, pose_at(0, 0, 0));
  const std::string before = map.fingerprint();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  Pose crooked = pose_at(0, 0, 0);
  crooked.rotation.w() = 2.0;
  for (const Pose& pose : {pose_at(1e7, 0, 0), pose_at(0, nan, 0), crooked}) {
    EXPECT_EQ(map.insert(cloud, pose).rejected, cloud.size());
  }
  const std::vector<CloudPoint> bad = {{{nan, 0.0F, 0.0F}, 1.0F}, {{1e30F, 0.0F, 0.0F}, 1.0F}};
  const InsertCounts counts = map.insert(bad, pose_at(0, 0, 0));
  EXPECT_EQ(counts.rejected, 1U);
  EXPECT_EQ(counts.outside, 1U);
  EXPECT_EQ(map.fingerprint(), before);
}

TEST(ThreeLevelMap, ReplaceWorldEqualsAFreshBuildWhateverWasThereBefore) {
  std::mt19937 generator(5);
  std::vector<PlacedCloud> clouds;
  for (int id = 0; id < 8; ++id) {
    clouds.push_back({id, std::make_shared<const std::vector<CloudPoint>>(random_cloud(generator, 2'000, 14.0, 4.0)),
                      pose_at(6 * id, 0, -2 * id, 0.3 * id)});
  }
  ThreeLevelMap used(MapConfig{});
  for (int step = 0; step < 30; ++step) used.insert(random_cloud(generator, 300, 14.0, 4.0), pose_at(2 * step, 0, 3));
  ThreeLevelMap fresh(MapConfig{});
  const Pose here = pose_at(40, 0, -12, 1.0);
  used.replace_world(clouds, here);
  fresh.replace_world(clouds, here);
  EXPECT_GT(fresh.level(0).size(), 0U);
  EXPECT_GT(fresh.level(1).size(), 0U);
  EXPECT_GT(fresh.level(2).size(), 0U);
  EXPECT_EQ(used.fingerprint(), fresh.fingerprint());
  clouds.back().T_world_body.translation.x() += 0.5;
  fresh.replace_world(clouds, here);
  EXPECT_NE(used.fingerprint(), fresh.fingerprint());
}

TEST(ThreeLevelMap, StaysBelowItsCapByCoarseningTheFinestLevel) {
  std::mt19937 generator(6);
  MapConfig config;
  config.max_voxels = 10'000;
  ThreeLevelMap map(config);
  for (int step = 0; step < 400; ++step) {
    map.insert(random_cloud(generator, 500, 9.0, 4.0), pose_at(2.0 * step, 0, 0));
    ASSERT_LE(map.size(), 10'000U);
  }
  EXPECT_GT(map.coarsened(), 0);
  EXPECT_GT(map.level(2).size(), 1'000U);
}

TEST(ThreeLevelMap, ViewShowsEveryPlaceOnceAndTheCoarserLevelsInsideTheRadiusOnly) {
  std::mt19937 generator(7);
  ThreeLevelMap map(MapConfig{});
  for (int step = 0; step <= 40; ++step) map.insert(random_cloud(generator, 2'000, 9.0, 3.0), pose_at(step, 0, 0));
  // Back again, so that fresh local voxels lie over older mid and coarse ones.
  for (int step = 40; step >= 0; --step) map.insert(random_cloud(generator, 500, 9.0, 3.0), pose_at(step, 0, 0));
  const double radius = 25.0;
  const MapView view = map.view(radius);
  EXPECT_EQ(view[0].voxels.size(), map.level(0).size());
  const int ratios[] = {1, 2, 4};
  std::array<std::set<CellIndex>, kLevels> shown;
  for (std::size_t i = 0; i < kLevels; ++i) {
    for (const ViewVoxel& voxel : view[i].voxels) {
      EXPECT_TRUE(shown[i].insert(voxel.cell).second);
      const Eigen::Vector3d p = map.level(i).find(voxel.cell)->p_world;
      EXPECT_LE(horizontal(p, map.centre()), radius);
      EXPECT_GE(p.y(), view[i].min_height);
      EXPECT_LE(p.y(), view[i].max_height);
    }
  }
  const auto covered = [&](std::size_t coarse, const CellIndex& cell) {
    for (std::size_t fine = 0; fine < coarse; ++fine) {
      for (const CellIndex& child : shown[fine]) {
        if (parent_cell(child, ratios[coarse] / ratios[fine]) == cell) return true;
      }
    }
    return false;
  };
  std::size_t hidden = 0;
  map.level(1).for_each([&](const CellIndex& cell, const MapPoint& point) {
    if (horizontal(point.p_world, map.centre()) > radius || hidden > 50) return;
    EXPECT_NE(shown[1].contains(cell), covered(1, cell));
    if (!shown[1].contains(cell)) ++hidden;
  });
  EXPECT_GT(hidden, 0U) << "no mid voxel was covered by a local one";
  int checked = 0;
  map.level(2).for_each([&](const CellIndex& cell, const MapPoint& point) {
    if (horizontal(point.p_world, map.centre()) > radius || ++checked > 50) return;
    EXPECT_NE(shown[2].contains(cell), covered(2, cell));
  });
}

TEST(ThreeLevelMap, ReportsTheMemoryOfItsTables) {
  std::mt19937 generator(8);
  ThreeLevelMap map(MapConfig{});
  EXPECT_LT(map.bytes(), 1'000U);
  map.insert(random_cloud(generator, 50'000, 9.0, 4.0), pose_at(0, 0, 0));
  EXPECT_GE(map.bytes(), map.size() * 33);
  EXPECT_LE(map.bytes(), map.size() * 33 * 3);
}

}  // namespace
}  // namespace ignis
