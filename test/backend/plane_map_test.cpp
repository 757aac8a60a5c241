// SPDX-License-Identifier: Apache-2.0
#include "backend/plane_map.h"

#include <gtest/gtest.h>

#include <random>

namespace ignis {
namespace {

constexpr PlaneGates kGates{0.6, 0.05, 6};

std::vector<Eigen::Vector3d> wall(double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-3.0, 3.0);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 1500; ++i) {
    const double y = place(random);
    points.emplace_back(2.0 + noise * normal(random), y, place(random));
  }
  return points;
}

TEST(PlaneMap, FindsTheNearestPointAsABruteForceSearchDoes) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-4.0, 4.0);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 800; ++i) {
    const double x = place(random);
    points.emplace_back(x, place(random), 0.02 * x);
  }
  PlaneMap map(points, 1e-3, {1.5, 0.05, 4});
  for (int i = 0; i < 300; ++i) {
    const double x = place(random);
    const Eigen::Vector3d query(x, place(random), place(random) * 0.3);
    double nearest = 1e9;
    for (const Eigen::Vector3d& p : points) nearest = std::min(nearest, (p - query).norm());
    for (const double radius : {0.2, 0.9, 2.0}) {
      if (std::abs(nearest - radius) < 1e-9) continue;
      EXPECT_EQ(map.nearest_plane(query, radius).has_value(), nearest < radius) << nearest << ' ' << radius;
    }
  }
}

TEST(PlaneMap, FitsTheNormalOfANoisyWall) {
  PlaneMap map(wall(0.01, 1), 0.05, kGates);
  const auto plane = map.nearest_plane({2.2, 0.5, 0.5}, 0.5);
  ASSERT_TRUE(plane);
  EXPECT_GT(std::abs(plane->normal.x()), 0.999);
  EXPECT_NEAR(plane->normal.dot(Eigen::Vector3d(2.0, 0.5, 0.5) - plane->centre), 0.0, 0.01);
}

TEST(PlaneMap, RefusesThickThinAndSparseNeighbourhoods) {
  PlaneMap thick(wall(0.15, 2), 0.05, kGates);
  EXPECT_FALSE(thick.nearest_plane({2.0, 0.0, 0.0}, 0.5));
  std::vector<Eigen::Vector3d> line;
  for (int i = 0; i < 40; ++i) line.emplace_back(0.05 * i, 0.0, 0.0);
  PlaneMap thin(line, 0.01, kGates);
  EXPECT_FALSE(thin.nearest_plane({1.0, 0.0, 0.0}, 0.5));
  PlaneMap sparse(std::vector<Eigen::Vector3d>{{0, 0, 0}, {0.3, 0, 0}, {0, 0.3, 0}, {0.3, 0.3, 0}}, 0.01, kGates);
  EXPECT_FALSE(sparse.nearest_plane({0.0, 0.0, 0.0}, 0.5));
}

TEST(PlaneMap, KeepsOnePointPerVoxelOnBothSidesOfZero) {
  const std::vector<Eigen::Vector3d> points = {{0.01, 0, 0}, {0.09, 0, 0}, {-0.01, 0, 0}, {-0.09, 0, 0}, {0.11, 0, 0}};
  const auto kept = one_per_voxel(points, 0.1);
  ASSERT_EQ(kept.size(), 3U);
  EXPECT_EQ(kept[0].x(), 0.01);
  EXPECT_EQ(kept[1].x(), -0.01);
  EXPECT_EQ(kept[2].x(), 0.11);
}

}  // namespace
}  // namespace ignis
