// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/plane_map.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include "common/so3.h"

namespace ignis {
namespace {

constexpr PlaneGates kGates{0.05, 6};

PlaneMap map_of(const std::vector<CloudPoint>& cloud, double voxel_m, const Pose& T_map_cloud = Pose()) {
  const CloudInMap placed{cloud, T_map_cloud};
  return {std::span(&placed, 1), voxel_m, kGates};
}

CloudPoint point_at(double x, double y, double z) { return {Eigen::Vector3d(x, y, z).cast<float>(), 0.0F}; }

std::vector<CloudPoint> wall(double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-3.0, 3.0);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<CloudPoint> cloud;
  for (int i = 0; i < 3000; ++i) {
    const double y = place(random);
    cloud.push_back(point_at(2.0 + noise * normal(random), y, place(random)));
  }
  return cloud;
}

Eigen::Vector3i cell_by_floor(const Eigen::Vector3d& point, double voxel_m) {
  return (point / voxel_m).array().floor().cast<int>();
}

/// What nearest_plane() promises, by looking at all points: centres of gravity of the 27 voxels around a query.
std::optional<double> distance_by_brute_force(const std::vector<CloudPoint>& cloud, const Eigen::Vector3d& query,
                                              double voxel_m) {
  const Eigen::Vector3i home = cell_by_floor(query, voxel_m);
  std::map<std::array<int, 3>, std::pair<Eigen::Vector3d, int>> around;
  for (const CloudPoint& point : cloud) {
    const Eigen::Vector3d p = point.position.cast<double>();
    const Eigen::Vector3i offset = cell_by_floor(p, voxel_m) - home;
    if (offset.cwiseAbs().maxCoeff() > 1) continue;
    auto& [sum, count] =
        around.try_emplace({offset.x(), offset.y(), offset.z()}, Eigen::Vector3d::Zero(), 0).first->second;
    sum += p;
    ++count;
  }
  std::optional<double> nearest;
  for (const auto& [offset, content] : around) {
    const double distance = (content.first / content.second - query).norm();
    if (offset == std::array{0, 0, 0}) return distance;
    if (!nearest || distance < *nearest) nearest = distance;
  }
  return nearest;
}

TEST(PlaneMap, FindsTheVoxelThatASearchThroughAllPointsFinds) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-4.0, 4.0);
  std::vector<CloudPoint> cloud;
  for (int i = 0; i < 400; ++i) cloud.push_back(point_at(place(random), place(random), 0.3 * place(random)));
  const PlaneMap map = map_of(cloud, 0.4);
  int found = 0;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d query(place(random), place(random), 0.3 * place(random));
    const std::optional<double> nearest = distance_by_brute_force(cloud, query, 0.4);
    for (const double radius : {0.2, 0.4, 0.8}) {
      EXPECT_EQ(map.has_points_near(query, radius), nearest && *nearest < radius) << i << ' ' << radius;
      found += map.has_points_near(query, radius) ? 1 : 0;
    }
  }
  EXPECT_GT(found, 200);
}

TEST(PlaneMap, FitsTheNormalOfANoisyWall) {
  PlaneMap map = map_of(wall(0.01, 1), 0.3);
  for (const double x : {2.0, 2.2, 1.8}) {
    const auto plane = map.nearest_plane({x, 0.5, 0.5}, 0.5);
    ASSERT_TRUE(plane);
    EXPECT_GT(std::abs(plane->normal.x()), 0.999);
    EXPECT_NEAR(plane->normal.dot(Eigen::Vector3d(2.0, 0.5, 0.5) - plane->centre), 0.0, 0.01);
  }
  EXPECT_FALSE(map.nearest_plane({2.2, 0.5, 0.5}, 0.1));
  EXPECT_FALSE(map.nearest_plane({4.0, 0.5, 0.5}, 5.0));
}

TEST(PlaneMap, PlacesACloudInItsOwnFrame) {
  const Pose T_map_cloud{so3::exp({0.0, 0.5 * std::numbers::pi, 0.0}), {7.0, 0.0, 1.0}};
  PlaneMap map = map_of(wall(0.01, 4), 0.3, T_map_cloud);
  const auto plane = map.nearest_plane(T_map_cloud * Eigen::Vector3d(2.0, 0.5, 0.5), 0.5);
  ASSERT_TRUE(plane);
  EXPECT_GT(std::abs(plane->normal.dot(T_map_cloud.rotation * Eigen::Vector3d::UnitX())), 0.999);
}

TEST(PlaneMap, RefusesThickThinAndSparseNeighbourhoods) {
  EXPECT_FALSE(map_of(wall(0.15, 2), 0.3).nearest_plane({2.0, 0.0, 0.0}, 0.5));
  std::vector<CloudPoint> line;
  for (int i = 0; i < 40; ++i) line.push_back(point_at(0.05 * i, 0.0, 0.0));
  EXPECT_FALSE(map_of(line, 0.3).nearest_plane({1.0, 0.0, 0.0}, 0.5));
  const std::vector<CloudPoint> sparse = {point_at(0, 0, 0), point_at(0.2, 0, 0), point_at(0, 0.2, 0),
                                          point_at(0.2, 0.2, 0)};
  EXPECT_FALSE(map_of(sparse, 0.3).nearest_plane({0.0, 0.0, 0.0}, 0.5));
}

TEST(PlaneMap, HasThePlanesOfLargerVoxelsWhenCoarser) {
  const PlaneMap fine = map_of(wall(0.01, 5), 0.25);
  PlaneMap coarse = fine.coarser(1.0);
  EXPECT_LT(coarse.size(), fine.size() / 8);
  const auto plane = coarse.nearest_plane({2.9, 0.5, 0.5}, 2.0);
  ASSERT_TRUE(plane);
  EXPECT_GT(std::abs(plane->normal.x()), 0.999);
  EXPECT_NEAR(plane->centre.x(), 2.0, 0.01);
}

TEST(PlaneMap, LeavesOutPointsThatAreNotFinite) {
  std::vector<CloudPoint> cloud = wall(0.01, 6);
  const PlaneMap clean = map_of(cloud, 0.3);
  cloud.push_back(point_at(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0));
  cloud.push_back(point_at(0.0, std::numeric_limits<double>::infinity(), 0.0));
  EXPECT_EQ(map_of(cloud, 0.3).size(), clean.size());
}

TEST(PlaneMap, KeepsOnePointPerVoxelOnBothSidesOfZero) {
  const std::vector<CloudPoint> cloud = {
      point_at(0.01, 0, 0),  point_at(0.09, 0, 0), point_at(-0.01, 0, 0),
      point_at(-0.09, 0, 0), point_at(0.11, 0, 0), point_at(std::numeric_limits<double>::quiet_NaN(), 0, 0)};
  const auto kept = one_per_voxel(cloud, 0.1);
  ASSERT_EQ(kept.size(), 3U);
  EXPECT_EQ(kept[0].position.x(), 0.01F);
  EXPECT_EQ(kept[1].position.x(), -0.01F);
  EXPECT_EQ(kept[2].position.x(), 0.11F);
}

}  // namespace
}  // namespace ignis
