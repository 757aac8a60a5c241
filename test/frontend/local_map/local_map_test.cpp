// SPDX-License-Identifier: Apache-2.0
#include "frontend/local_map/local_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/so3.h"
#include "frontend/local_map/neighbour_search.h"

namespace ignis {
namespace {

std::vector<Eigen::Vector3f> random_points(std::uint32_t seed, int count, float half) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-half, half);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < count; ++i) {
    const float x = uniform(random);
    const float y = uniform(random);
    const float z = uniform(random);
    points.emplace_back(x, y, z);
  }
  return points;
}

TEST(LocalMap, GathersExactlyWhatABruteForceSearchFinds) {
  const FrontendConfig config;
  LocalMap map(config);
  map.insert(random_points(1, 20000, 4.0F), {so3::exp({0.1, 0.2, 0.3}), {100.0, -3.0, -50.0}}, true);
  const std::vector<Eigen::Vector3d> all = map.points();
  ASSERT_EQ(static_cast<int>(all.size()), map.size());
  for (const Eigen::Vector3f& offset : random_points(2, 200, 5.0F)) {
    const Eigen::Vector3d query = Eigen::Vector3d(100.0, -3.0, -50.0) + offset.cast<double>();
    NeighbourMoments expected;
    for (const Eigen::Vector3d& point : all) {
      if ((point - query).norm() <= config.match_radius_m) expected.add({.offset = point - query});
    }
    const NeighbourMoments found = map.gather(query);
    EXPECT_EQ(found.count, expected.count);
    EXPECT_EQ(found.weight, expected.weight);
    EXPECT_LT((found.sum - expected.sum).norm(), 1e-4);
    EXPECT_LT((found.sum_outer - expected.sum_outer).norm(), 1e-4);
  }
}

TEST(LocalMap, GathersWeightsSidesAndScansAsABruteForceSumDoes) {
  FrontendConfig config;
  config.map_average_points = 60000;
  LocalMap map(config);
  for (const int times : {1, 3, 2}) {
    for (int i = 0; i < times; ++i) {
      map.insert(random_points(static_cast<std::uint32_t>(times), 4000, 3.0F),
                 {so3::exp({0.1, 0.2, 0.3}), {0.5 * times, 0.0, -1.0}}, true);
    }
  }
  // One voxel at a time, by a radius that reaches no other: these are the neighbours.
  std::vector<std::pair<Eigen::Vector3d, NeighbourMoments>> voxels;
  for (const Eigen::Vector3d& point : map.points()) {
    voxels.emplace_back(point, map.gather(point, 1e-4));
    ASSERT_EQ(voxels.back().second.count, 1);
  }
  const Eigen::Vector3d side = Eigen::Vector3d(1.0, -0.5, 0.3).normalized();
  for (const Eigen::Vector3f& at : random_points(2, 100, 3.0F)) {
    const Eigen::Vector3d query = at.cast<double>();
    NeighbourMoments expected;
    for (const auto& [point, voxel] : voxels) {
      const Eigen::Vector3d view = voxel.view_sum / voxel.weight;
      if ((point - query).norm() > 0.5 || view.dot(side) < 0.0) continue;
      expected.add(
          {.offset = point - query, .weight = voxel.weight, .scan = voxel.scan_sum / voxel.weight, .view = view});
    }
    const NeighbourMoments found = map.gather(query, 0.5, side);
    ASSERT_EQ(found.count, expected.count);
    EXPECT_EQ(found.weight, expected.weight);
    EXPECT_NEAR(found.scan_sum, expected.scan_sum, 1e-4 * expected.weight);
    EXPECT_LE((found.view_sum - expected.view_sum).norm(), 1e-5 * expected.weight);
    EXPECT_LE((found.sum - expected.sum).norm(), 1e-5 * expected.weight);
    EXPECT_LE((found.sum_outer - expected.sum_outer).norm(), 1e-5 * expected.weight);
  }
}

TEST(NeighbourSearch, GathersForManyQueriesToTheBitWhatTheMapGathersForEach) {
  const FrontendConfig config;
  LocalMap map(config);
  map.insert(random_points(1, 20000, 4.0F), {}, true);
  map.insert(random_points(3, 3000, 8.0F), {}, false);
  NeighbourSearch search;
  for (const int count : {0, 1, 16, 200, 37}) {
    std::vector<Eigen::Vector3d> queries;
    for (const Eigen::Vector3f& at : random_points(2, count, 6.0F)) queries.push_back(at.cast<double>());
    std::vector<Eigen::Vector3d> sides;
    for (const Eigen::Vector3f& side : random_points(4, count, 1.0F)) sides.push_back(side.cast<double>());
    const auto expect_each = [&](std::span<const FourMoments> four, const auto& side_of) {
      ASSERT_EQ(four.size(), (queries.size() + 3) / 4);
      for (std::size_t i = 0; i < 4 * four.size(); ++i) {
        const NeighbourMoments found = four[i / 4].of(static_cast<int>(i % 4));
        const NeighbourMoments expected =
            i < queries.size() ? map.gather(queries[i], 0.45, side_of(i)) : NeighbourMoments();
        ASSERT_EQ(found.count, expected.count);
        ASSERT_EQ(found.weight, expected.weight);
        ASSERT_EQ(found.scan_sum, expected.scan_sum);
        ASSERT_EQ(found.view_sum, expected.view_sum);
        ASSERT_EQ(found.sum, expected.sum);
        ASSERT_EQ(found.sum_outer, expected.sum_outer);
      }
    };
    expect_each(search.gather(map, queries, 0.45), [](std::size_t) { return Eigen::Vector3d::Zero().eval(); });
    expect_each(search.gather(map, queries, 0.45, sides), [&](std::size_t i) { return sides[i]; });
  }
}

/// A wall at x = 1 whose points are seen from both sides: from the origin and from x = 2.
TEST(LocalMap, GathersWhatWasSeenFromOneSideOfAPlane) {
  FrontendConfig config;
  config.map_average_points = 1000;
  LocalMap map(config);
  std::vector<Eigen::Vector3f> near_face;
  std::vector<Eigen::Vector3f> far_face;
  for (float y = -1.0F; y < 1.0F; y += 0.1F) {
    for (float z = -1.0F; z < 1.0F; z += 0.1F) {
      near_face.emplace_back(0.95F, y, z);
      far_face.emplace_back(-0.85F, y, z);  // of a body at x = 2
    }
  }
  map.insert(near_face, {}, true);
  map.insert(far_face, {Eigen::Quaterniond::Identity(), {2.0, 0.0, 0.0}}, true);
  const Eigen::Vector3d query(1.05, 0.1, 0.1);
  const Eigen::Vector3d normal = Eigen::Vector3d::UnitX();
  const NeighbourMoments both = map.gather(query, 0.4);
  const NeighbourMoments front = map.gather(query, 0.4, -normal);
  const NeighbourMoments back = map.gather(query, 0.4, normal);
  EXPECT_EQ(both.count, front.count + back.count);
  EXPECT_NEAR(front.sum.x() / front.weight, -0.10, 1e-6);
  EXPECT_NEAR(back.sum.x() / back.weight, 0.10, 1e-6);
  EXPECT_TRUE(is_seen_from_other_side(fit_plane(front, config, 0.4), normal));
  EXPECT_FALSE(is_seen_from_other_side(fit_plane(front, config, 0.4), -normal));
  PlaneFit wall = fit_plane(front, config, 0.4);
  const Eigen::Vector3d at_three_degrees(0.5, 9.99, 0.0);
  EXPECT_TRUE(is_seen_from_other_side(wall, at_three_degrees)) << "its normal is known";
  wall.normal_sigma.col(0) = 0.05 * Eigen::Vector3d::UnitY();
  EXPECT_FALSE(is_seen_from_other_side(wall, at_three_degrees)) << "its normal may be off by as much";
}

/// Whatever the place of a plane in the grid, its noisy points are fitted where it is.
TEST(LocalMap, AMeanOfManyPointsHasNoBiasTowardsTheGrid) {
  constexpr float kSigma = 0.02F;
  for (const int average : {1, 60000}) {
    double worst = 0.0;
    for (const double height : {0.0, 0.01, 0.02, 0.03, 0.04, 0.05}) {
      FrontendConfig config;
      config.voxel_size_m = 0.1;
      config.match_radius_m = 0.15;
      config.map_average_points = average;
      LocalMap map(config);
      std::mt19937 random(7);
      std::normal_distribution<float> normal(0.0F, kSigma);
      std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
      for (int scan = 0; scan < 200; ++scan) {
        std::vector<Eigen::Vector3f> points;
        for (int i = 0; i < 200; ++i) {
          const float x = uniform(random);
          const float z = uniform(random);
          points.emplace_back(x, static_cast<float>(height) + normal(random), z);
        }
        map.insert(points, {Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()}, true);
      }
      double sum = 0.0;
      int count = 0;
      for (double x = -0.7; x < 0.7; x += 0.05) {
        for (double z = -0.7; z < 0.7; z += 0.05) {
          const NeighbourMoments moments = map.gather({x, height, z});
          sum += moments.sum.y() / moments.weight;
          ++count;
        }
      }
      worst = std::max(worst, std::abs(sum / count));
    }
    if (average == 1) {
      EXPECT_GT(worst, 0.002) << "else this test shows nothing";
    } else {
      EXPECT_LT(worst, 0.001);
    }
  }
}

TEST(LocalMap, FindsTheNearestConfirmedPointThatABruteForceSearchFinds) {
  LocalMap map(FrontendConfig{});
  map.insert(random_points(1, 3000, 4.0F), {}, true);
  const std::vector<Eigen::Vector3d> all = map.points();
  map.insert(random_points(5, 3000, 4.0F), {}, false);
  for (const Eigen::Vector3f& offset : random_points(2, 200, 5.0F)) {
    const Eigen::Vector3d query = offset.cast<double>();
    const Eigen::Vector3d expected =
        *std::ranges::min_element(all, {}, [&](const Eigen::Vector3d& point) { return (point - query).squaredNorm(); });
    const std::optional<Eigen::Vector3d> found = map.nearest(query, 1.0);
    ASSERT_EQ(found.has_value(), (expected - query).norm() <= 1.0);
    if (found) {
      EXPECT_NEAR((*found - query).norm(), (expected - query).norm(), 1e-5);
    }
  }
}

TEST(LocalMap, FindsTheMeanOfTheVoxelThatAPointLiesInOnceItIsOfEnoughPoints) {
  FrontendConfig config;
  config.map_average_points = 60000;
  LocalMap map(config);
  map.insert(random_points(1, 6000, 1.0F), {}, true);
  const std::vector<Eigen::Vector3d> all = map.points();
  map.insert(random_points(5, 6000, 1.5F), {}, false);
  const auto voxel_of = [&](const Eigen::Vector3d& point) -> Eigen::Array3d {
    return (point / config.voxel_size_m).array().floor();
  };
  for (const Eigen::Vector3f& point : random_points(2, 400, 1.5F)) {
    const Eigen::Vector3d query = point.cast<double>();
    const auto expected = std::ranges::find_if(
        all, [&](const Eigen::Vector3d& mean) { return (voxel_of(mean) == voxel_of(query)).all(); });
    const bool is_enough = expected != all.end() && map.gather(*expected, 1e-4).weight >= 5.0;
    const std::optional<Eigen::Vector3d> found = map.own_voxel(query, 5.0F, Eigen::Vector3d::Zero());
    ASSERT_EQ(found.has_value(), is_enough);
    if (found) {
      EXPECT_EQ(*found, *expected);
    }
  }
}

TEST(LocalMap, KeepsThePointNearestTheVoxelCentre) {
  LocalMap map(FrontendConfig{});
  map.insert(std::vector<Eigen::Vector3f>{{0.01F, 0.01F, 0.01F}, {0.11F, 0.1F, 0.1F}, {0.15F, 0.1F, 0.1F}}, {}, true);
  ASSERT_EQ(map.size(), 1);
  EXPECT_LT((map.points()[0] - Eigen::Vector3d(0.11, 0.1, 0.1)).norm(), 1e-6);
}

TEST(LocalMap, MeanOfAVoxelLosesTheRangeNoise) {
  const auto rms_of_wall = [](int average) {
    FrontendConfig config;
    config.map_average_points = average;
    LocalMap map(config);
    std::mt19937 random(4);
    std::normal_distribution<float> normal(0.0F, 0.02F);
    std::uniform_real_distribution<float> uniform(-2.0F, 2.0F);
    for (int scan = 0; scan < 50; ++scan) {
      std::vector<Eigen::Vector3f> points;
      for (int i = 0; i < 400; ++i) {
        const float x = uniform(random);
        const float y = uniform(random);
        points.emplace_back(x, y, 0.1F + normal(random));
      }
      map.insert(points, {}, true);
    }
    double sum = 0.0;
    for (const Eigen::Vector3d& point : map.points()) sum += (point.z() - 0.1) * (point.z() - 0.1);
    return std::sqrt(sum / map.size());
  };
  EXPECT_LT(rms_of_wall(1000), 0.006) << "50 points a voxel: 0.02 / sqrt(50) = 0.003";
  EXPECT_LT(rms_of_wall(1000), 0.6 * rms_of_wall(1));
}

TEST(LocalMap, KnowsWhichScansItsPointsComeFrom) {
  FrontendConfig config;
  config.map_average_points = 1000;
  LocalMap map(config);
  const std::vector<Eigen::Vector3f> point = {{0.1F, 0.1F, 0.1F}};
  for (int scan = 0; scan < 4; ++scan) map.insert(point, {}, true);
  EXPECT_EQ(map.scans(), 4);
  const NeighbourMoments moments = map.gather({0.1, 0.1, 0.1});
  EXPECT_EQ(moments.count, 1);
  EXPECT_EQ(moments.weight, 4.0);
  EXPECT_NEAR(moments.scan_sum / moments.weight, 2.5, 1e-6);
}

TEST(LocalMap, HandlesNegativeCoordinates) {
  LocalMap map(FrontendConfig{});
  map.insert(std::vector<Eigen::Vector3f>{{-0.05F, -0.05F, -0.05F}, {0.05F, 0.05F, 0.05F}}, {}, true);
  EXPECT_EQ(map.size(), 2);
  EXPECT_EQ(map.gather(Eigen::Vector3d::Zero()).count, 2);
}

TEST(LocalMap, UnconfirmedPointsHaveNoVoteUntilAnAgreeingScanReplacesThem) {
  LocalMap map(FrontendConfig{});
  map.insert(std::vector<Eigen::Vector3f>{{0.1F, 0.1F, 0.1F}}, {}, false);
  EXPECT_EQ(map.size(), 1);
  EXPECT_EQ(map.gather({0.1, 0.1, 0.1}).count, 0);
  map.insert(std::vector<Eigen::Vector3f>{{0.02F, 0.02F, 0.02F}}, {}, true);
  EXPECT_EQ(map.size(), 1);
  EXPECT_EQ(map.gather({0.1, 0.1, 0.1}).count, 1);
  EXPECT_LT((map.points()[0] - Eigen::Vector3d(0.02, 0.02, 0.02)).norm(), 1e-6);
}

TEST(LocalMap, UnconfirmedPointsNeverReplaceConfirmedOnes) {
  LocalMap map(FrontendConfig{});
  map.insert(std::vector<Eigen::Vector3f>{{0.02F, 0.02F, 0.02F}}, {}, true);
  map.insert(std::vector<Eigen::Vector3f>{{0.1F, 0.1F, 0.1F}}, {}, false);
  EXPECT_LT((map.points()[0] - Eigen::Vector3d(0.02, 0.02, 0.02)).norm(), 1e-6);
}

/// What the scans of a vehicle that stays there do.
void slide_at(LocalMap& map, const Eigen::Vector3d& position, int sure_since) {
  for (int i = 0; i < LocalMap::kSlidesToSweep; ++i) map.slide(position, sure_since);
}

TEST(LocalMap, SlidesOnlyAfterAQuarterOfTheWindow) {
  FrontendConfig config;
  LocalMap map(config);
  map.slide(Eigen::Vector3d::Zero(), 0);
  map.insert(random_points(3, 5000, 18.0F), {}, true);
  const int before = map.size();
  slide_at(map, {4.9, 0.0, 0.0}, 0);
  EXPECT_EQ(map.size(), before);
  const Eigen::Vector3d position(5.1, 0.0, 0.0);
  slide_at(map, position, 0);
  EXPECT_LT(map.size(), before);
  for (const Eigen::Vector3d& point : map.points()) {
    EXPECT_LE(std::abs(point.x() - position.x()), config.map_window_m);
    EXPECT_LE(std::abs(point.y()), config.map_window_y);
  }
  const auto all = map.points();
  const NeighbourMoments found = map.gather(all.front());
  EXPECT_GE(found.count, 1) << "the table must find what is left after a prune";
}

TEST(LocalMap, KeepsWhatIsSurelyPlacedBeyondTheWindow) {
  FrontendConfig config;
  config.map_memory_m = 60.0;
  LocalMap map(config);
  map.slide(Eigen::Vector3d::Zero(), 0);
  map.insert(std::vector<Eigen::Vector3f>{{0.0F, 0.0F, 0.0F}}, {}, true);
  map.insert(std::vector<Eigen::Vector3f>{{1.0F, 0.0F, 0.0F}}, {}, true);
  map.insert(std::vector<Eigen::Vector3f>{{1.0F, 8.5F, 0.0F}}, {}, true);
  slide_at(map, {15.0, 0.0, 0.0}, 2);
  EXPECT_EQ(map.size(), 2) << "inside the window all but what lies too high";
  slide_at(map, {30.0, 0.0, 0.0}, 2);
  ASSERT_EQ(map.size(), 1) << "outside what is sure";
  EXPECT_NEAR(map.points()[0].x(), 1.0, 1e-6) << "the second scan's";
  EXPECT_EQ(map.gather({1.0, 0.0, 0.0}).count, 1);
  slide_at(map, {62.0, 0.0, 0.0}, 2);
  EXPECT_TRUE(map.empty());
}

TEST(LocalMap, ForgetsBeyondTheWindowWhatIsNoLongerSure) {
  FrontendConfig config;
  config.map_memory_m = 60.0;
  LocalMap map(config);
  map.slide(Eigen::Vector3d::Zero(), 0);
  map.insert(std::vector<Eigen::Vector3f>{{0.1F, 0.1F, 0.1F}}, {}, true);
  map.insert(std::vector<Eigen::Vector3f>{{0.5F, 0.1F, 0.1F}}, {}, true);
  slide_at(map, {30.0, 0.0, 0.0}, 1);
  EXPECT_EQ(map.size(), 2) << "both are sure";
  slide_at(map, {36.0, 0.0, 0.0}, 1);
  EXPECT_EQ(map.size(), 2);
  slide_at(map, {42.0, 0.0, 0.0}, 2);
  ASSERT_EQ(map.size(), 1) << "a neighbour within centimetres is younger, and stays";
  EXPECT_NEAR(map.points()[0].x(), 0.5, 1e-6);
}

TEST(LocalMap, FindsAllThatIsLeftWhileItIsBeingSwept) {
  LocalMap map(FrontendConfig{});
  map.slide(Eigen::Vector3d::Zero(), 0);
  map.insert(random_points(3, 5000, 18.0F), {}, true);
  const int before = map.size();
  const Eigen::Vector3d position(9.0, 0.0, 0.0);
  for (int i = 0; i < 20; ++i) {
    const int size = map.size();
    map.slide(position, 0);
    EXPECT_LT(size - map.size(), before / 4) << "no scan bears the cost of all";
    map.insert(random_points(static_cast<std::uint32_t>(10 + i), 50, 10.0F), {}, true);
    for (const Eigen::Vector3d& point : map.points()) ASSERT_GE(map.gather(point).count, 1);
  }
  EXPECT_LT(map.size(), before);
}

TEST(LocalMap, StaysBoundedOnALongDrive) {
  LocalMap map(FrontendConfig{});
  int largest = 0;
  for (int i = 0; i < 200; ++i) {
    const Pose T_odom_body{Eigen::Quaterniond::Identity(), {2.0 * i, 0.0, 0.0}};
    map.insert(random_points(static_cast<std::uint32_t>(i), 500, 10.0F), T_odom_body, true);
    map.slide(T_odom_body.translation, 0);
    largest = std::max(largest, map.size());
  }
  EXPECT_LT(largest, 500 * 20);
}

TEST(LocalMap, RefusesAnImpossibleConfiguration) {
  FrontendConfig config;
  config.voxel_size_m = 0.0;
  config.iterations = 0;
  try {
    LocalMap map(config);
    FAIL() << "accepted";
  } catch (const config::ConfigError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("frontend.voxel_size_m"), std::string::npos);
    EXPECT_NE(message.find("frontend.iterations"), std::string::npos);
  }
}

}  // namespace
}  // namespace ignis
