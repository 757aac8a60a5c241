// SPDX-License-Identifier: Apache-2.0
#include "map/voxel_level.h"

#include <algorithm>
#include <map>
#include <random>

#include <gtest/gtest.h>

namespace ignis {
namespace {

constexpr double kCell = 0.125;

std::vector<MapPoint> random_points(std::uint32_t seed, std::size_t count, double reach) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> coordinate(-reach, reach);
  std::vector<MapPoint> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back({{coordinate(generator), coordinate(generator), coordinate(generator)},
                      static_cast<float>(i % 256),
                      static_cast<std::int32_t>(i)});
  }
  return points;
}

TEST(VoxelLevel, HoldsTheNearestPointOfEachCellLikeABruteForceSearch) {
  const std::vector<MapPoint> points = random_points(1, 20'000, 1.0);
  VoxelLevel level(kCell);
  std::map<CellIndex, std::pair<double, std::int32_t>> nearest;
  for (const MapPoint& point : points) {
    level.insert(point);
    const CellIndex cell = level.cell_of(point.p_world);
    const double distance = (point.p_world - level.centre_of(cell)).norm();
    const auto [found, is_new] = nearest.try_emplace(cell, distance, point.keyframe_id);
    if (!is_new && distance < found->second.first) found->second = {distance, point.keyframe_id};
  }
  ASSERT_EQ(level.size(), nearest.size());
  for (const auto& [cell, expected] : nearest) {
    ASSERT_TRUE(level.find(cell));
    EXPECT_EQ(level.find(cell)->keyframe_id, expected.second);
  }
}

TEST(VoxelLevel, DoesNotDependOnTheOrderOfInsertion) {
  std::vector<MapPoint> points = random_points(2, 5'000, 1.0);
  VoxelLevel first(kCell);
  for (const MapPoint& point : points) first.insert(point);
  std::ranges::reverse(points);
  VoxelLevel second(kCell);
  for (const MapPoint& point : points) second.insert(point);
  const auto a = first.sorted();
  const auto b = second.sorted();
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].first, b[i].first);
    EXPECT_EQ(a[i].second.keyframe_id, b[i].second.keyframe_id);
  }
}

TEST(VoxelLevel, KeepsTheEarlierOfTwoEquallyNearPoints) {
  VoxelLevel level(kCell);
  const Eigen::Vector3d centre = level.centre_of({3, -4, 5});
  level.insert({centre + Eigen::Vector3d(0.03125, 0, 0), 1.0F, 7});
  level.insert({centre - Eigen::Vector3d(0.03125, 0, 0), 2.0F, 8});
  EXPECT_EQ(level.find({3, -4, 5})->keyframe_id, 7);
}

TEST(VoxelLevel, GivesPointsBackWhereTheyWereEvenFarFromTheOrigin) {
  VoxelLevel level(kCell);
  const Eigen::Vector3d p(-9'876.543, 12.345, 9'999.01);
  level.insert({p, 9.0F, 1});
  const std::optional<MapPoint> found = level.find(level.cell_of(p));
  ASSERT_TRUE(found);
  EXPECT_LT((found->p_world - p).norm(), 1e-7);
  EXPECT_FLOAT_EQ(found->intensity, 9.0F);
}

TEST(VoxelLevel, KeepsCellsApartAtTheFinestCellAndTheLargestCoordinate) {
  VoxelLevel level(0.01);
  const double edge = VoxelLevel::kMaxCoordinate - 0.005;
  for (const double x : {-edge, edge}) {
    for (const double y : {-edge, edge}) {
      for (const double z : {-edge, edge}) level.insert({{x, y, z}, 0.0F, kLive});
    }
  }
  EXPECT_EQ(level.size(), 8U);
  level.for_each([&](const CellIndex& cell, const MapPoint& point) {
    EXPECT_EQ(cell, level.cell_of(point.p_world));
    EXPECT_LT((point.p_world.cwiseAbs() - Eigen::Vector3d::Constant(edge)).norm(), 1e-6);
  });
}

TEST(VoxelLevel, ExtractMovesExactlyWhatLeaves) {
  VoxelLevel level(kCell);
  for (const MapPoint& point : random_points(3, 5'000, 2.0)) level.insert(point);
  const std::size_t before = level.size();
  std::size_t received = 0;
  level.extract([](const Eigen::Vector3d& p) { return p.x() > 0.5; },
                [&](const MapPoint& point) {
                  ++received;
                  EXPECT_GT(point.p_world.x(), 0.5);
                });
  EXPECT_GT(received, 0U);
  EXPECT_EQ(level.size() + received, before);
  level.for_each([](const CellIndex&, const MapPoint& point) { EXPECT_LE(point.p_world.x(), 0.5); });
}

TEST(ParentCell, ContainsTheCentreOfItsChildAlsoBelowZero) {
  const VoxelLevel fine(0.125);
  const VoxelLevel coarse(0.5);
  for (std::int32_t x = -9; x <= 9; ++x) {
    const CellIndex child{x, -x, 2 * x + 1};
    EXPECT_EQ(parent_cell(child, 4), coarse.cell_of(fine.centre_of(child)));
  }
}

}  // namespace
}  // namespace ignis
