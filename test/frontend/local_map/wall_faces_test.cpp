// SPDX-License-Identifier: Apache-2.0
//
// Walls so thin that both of their faces lie in one voxel or one neighbourhood: of partitions in offices, of shelves,
// of a door's leaf.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "frontend/local_map/local_map.h"
#include "frontend/matching/plane_finder.h"

namespace ignis {
namespace {

FrontendConfig config_with(bool two_faces) {
  FrontendConfig config;
  config.voxel_size_m = 0.1;
  config.match_radius_m = 0.15;
  config.wide_match_radius_m = 0.3;
  config.max_curvature = 0.3;
  config.map_average_points = 60000;
  config.map_two_faces = two_faces;
  return config;
}

/// Puts one point of a wall of 0.06 m into a map, all in one voxel, as seen from 2 m beside it.
void look_once(LocalMap& map, float side) {
  const Eigen::Vector3f body(2.0F * side, 0.05F, 0.05F);
  const Eigen::Vector3f point = Eigen::Vector3f(0.05F + 0.03F * side, 0.05F, 0.05F) - body;
  map.insert(std::vector{point}, {Eigen::Quaterniond::Identity(), body.cast<double>()}, true);
}

/// A wall across x whose middle is at 0.05 m, passed on the side of negative x first and on the other one then.
class Wall {
 public:
  Wall(double thickness, bool two_faces) : config(config_with(two_faces)), map(config), half_(0.5 * thickness) {
    for (const double side : {-1.0, 1.0}) {
      for (int scan = 0; scan < 100; ++scan) look_from({side * 2.0, 0.02 * scan - 1.0, 0.0});
    }
  }

  [[nodiscard]] double face(double side) const { return 0.05 + side * half_; }

  /// How far the wall that a body at x = +-2 finds is from its face there [m], in the mean; NaN where it finds hardly
  /// any.
  [[nodiscard]] double error_seen_from(double side) const {
    PlaneFinder finder(config);
    std::vector<Eigen::Vector3d> queries;
    for (double y = -0.6; y < 0.6; y += 0.07) queries.emplace_back(face(side), y, 0.3 * y);
    double sum = 0.0;
    std::size_t found = 0;
    for (const PlaneFit& plane : finder.find(map, queries, {side * 2.0, 0.0, 0.0})) {
      if (plane.verdict != PlaneVerdict::kPlane) continue;
      sum += plane.offset.dot(plane.normal) / plane.normal.x();
      ++found;
    }
    return 2 * found < queries.size() ? std::nan("") : sum / static_cast<double>(found);
  }

  FrontendConfig config;
  LocalMap map;

 private:
  void look_from(const Eigen::Vector3d& body) {
    std::normal_distribution<double> noise(0.0, 0.01);
    std::uniform_real_distribution<double> place(-1.0, 1.0);
    std::vector<Eigen::Vector3f> points;
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d point(face(std::copysign(1.0, body.x())) + noise(random_), place(random_), place(random_));
      points.push_back((point - body).cast<float>());
    }
    map.insert(points, {Eigen::Quaterniond::Identity(), body}, true);
  }

  double half_;
  std::mt19937 random_{3};
};

TEST(WallFaces, AreFoundWhereTheyAreHoweverThinTheWall) {
  for (const double thickness : {0.02, 0.04, 0.06, 0.08, 0.12, 0.2}) {
    const Wall wall(thickness, true);
    for (const double side : {-1.0, 1.0}) EXPECT_LT(std::abs(wall.error_seen_from(side)), 0.004) << thickness;
  }
  for (const double thickness : {0.06, 0.08, 0.12}) {
    const Wall wall(thickness, false);
    EXPECT_FALSE(std::abs(wall.error_seen_from(-1.0)) < 0.01) << thickness << ": else this test shows nothing";
  }
}

TEST(WallFaces, OfOneVoxelAreTwoPointsOfTheMapThatGoTogether) {
  for (const bool two_faces : {true, false}) {
    LocalMap map(config_with(two_faces));
    for (const float side : {-1.0F, 1.0F, -1.0F}) look_once(map, side);
    EXPECT_EQ(map.size(), two_faces ? 2 : 1);
    EXPECT_EQ(map.points().size(), static_cast<std::size_t>(map.size()));
    map.slide(Eigen::Vector3d::Zero(), 0);
    for (int i = 0; i < LocalMap::kSlidesToSweep; ++i) map.slide({1000.0, 0.0, 0.0}, 0);
    EXPECT_TRUE(map.empty()) << "both leave the window";
    EXPECT_TRUE(map.points().empty());
  }
}

TEST(WallFaces, StayApartWhenTheFirstOneHasLeftTheWindow) {
  FrontendConfig config = config_with(true);
  config.map_window_m = 10.0;
  config.map_memory_m = 100.0;
  LocalMap map(config);
  for (const float side : {-1.0F, 1.0F, 1.0F}) look_once(map, side);
  ASSERT_EQ(map.size(), 2);
  map.slide(Eigen::Vector3d::Zero(), 0);
  for (int i = 0; i < LocalMap::kSlidesToSweep; ++i) map.slide({0.0, 0.0, 50.0}, 2);
  ASSERT_EQ(map.size(), 1) << "what is of the first scan has gone";
  for (const float side : {1.0F, -1.0F, 1.0F}) look_once(map, side);
  EXPECT_EQ(map.size(), 2);
  for (const double side : {-1.0, 1.0}) {
    const auto own = map.own_voxel({0.05, 0.05, 0.05}, 1.0F, side * Eigen::Vector3d::UnitX());
    ASSERT_TRUE(own);
    EXPECT_NEAR(own->x(), 0.05 + 0.03 * side, 1e-6);
  }
}

TEST(WallFaces, AreAskedForBySide) {
  const Wall wall(0.06, true);
  for (const double side : {-1.0, 1.0}) {
    const auto own = wall.map.own_voxel({0.05, 0.25, 0.25}, 5.0F, side * Eigen::Vector3d::UnitX());
    ASSERT_TRUE(own);
    EXPECT_NEAR(own->x(), wall.face(side), 0.006);
  }
}

}  // namespace
}  // namespace ignis
