// SPDX-License-Identifier: Apache-2.0
#include "map/free_space.h"

#include <cmath>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "map/live_map.h"
#include "map/random_clouds.h"

namespace ignis {
namespace {

constexpr double kCell = 0.25;

std::set<CellIndex> cells_of(const std::vector<FreeCell>& free) {
  std::set<CellIndex> cells;
  for (const FreeCell cell : free) cells.insert(unpack_free_cell(cell));
  return cells;
}

CellIndex cell_of(const Eigen::Vector3d& p) {
  const auto axis = [](double x) { return static_cast<std::int32_t>(std::floor(x / kCell)); };
  return {axis(p.x()), axis(p.y()), axis(p.z())};
}

bool adjacent(const CellIndex& a, const CellIndex& b) {
  return std::abs(a.x - b.x) <= 1 && std::abs(a.y - b.y) <= 1 && std::abs(a.z - b.z) <= 1;
}

TEST(FreeSpace, ARayFreesTheCellsOnItsWayButNotThoseBesideItsHit) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> coordinate(-8.0, 8.0);
  for (int round = 0; round < 300; ++round) {
    const Eigen::Vector3d origin(coordinate(generator), coordinate(generator), coordinate(generator));
    Eigen::Vector3d hit(coordinate(generator), coordinate(generator), coordinate(generator));
    if (round % 10 == 0) hit.x() = origin.x();  // along a plane of the grid
    if (round % 20 == 0) hit.y() = origin.y();
    FreeSpace space(kCell, 1);
    space.add_ray(origin, hit);
    const std::set<CellIndex> free = cells_of(space.take());
    // By small steps instead of from border to border; a step may cut a corner, so this is the smaller set.
    std::set<CellIndex> passed;
    const int steps = 20'000;
    for (int i = 0; i < steps; ++i) passed.insert(cell_of(origin + (hit - origin) * (i / static_cast<double>(steps))));
    for (const CellIndex& cell : passed) EXPECT_EQ(free.contains(cell), !adjacent(cell, cell_of(hit)));
    EXPECT_LE(free.size(), passed.size() + 3) << "a corner that a step cuts, or rounding on a border";
  }
}

TEST(FreeSpace, AFewRaysAreNotEnough) {
  FreeSpace space(kCell, 3);
  for (int i = 0; i < 2; ++i) space.add_ray({0.1, 0.1, 0.1}, {5.0, 0.1, 0.1});
  EXPECT_TRUE(space.take().empty());
  for (int i = 0; i < 3; ++i) space.add_ray({0.1, 0.1, 0.1}, {5.0, 0.1, 0.1});
  EXPECT_EQ(cells_of(space.take()).size(), 19U) << "twenty cells of 0.25 m, but for the neighbour of the hit";
  EXPECT_TRUE(space.take().empty()) << "taken";
}

TEST(FreeSpace, WhatAnyScanHitIsNotFree) {
  FreeSpace space(kCell, 1);
  space.add_ray({0.1, 0.1, 0.1}, {5.0, 0.1, 0.1});
  space.add_hit({2.6, 0.1, 0.1});
  const std::set<CellIndex> free = cells_of(space.take());
  EXPECT_TRUE(free.contains({8, 0, 0}));
  for (int x = 9; x <= 11; ++x) EXPECT_FALSE(free.contains({x, 0, 0}));
  EXPECT_TRUE(free.contains({12, 0, 0}));
}

TEST(FreeSpace, LeavesOutWhatItsNumbersCannotHold) {
  FreeSpace space(kCell, 1);
  space.add_ray({0, 0, 0}, {400.0, 300.0, -400.0});
  for (const CellIndex& cell : cells_of(space.take())) {
    EXPECT_LT(cell.x, 1'024);
    EXPECT_LT(cell.y, 512);
    EXPECT_GE(cell.z, -1'024);
  }
}

/// A room, and something that stands in it for the first keyframe only.
TEST(Carving, WhatHasLeftGoesAndTheRoomStays) {
  MapConfig config;
  config.carve_free_space = true;
  LiveMap carved(config);
  LiveMap plain(MapConfig{});
  std::mt19937 generator(2);
  const auto scan_of_room = [&](bool with_box) {
    std::vector<CloudPoint> scan;
    std::uniform_real_distribution<float> direction(-1.0F, 1.0F);
    for (int i = 0; i < 3'000; ++i) {
      Eigen::Vector3f ray(direction(generator), 0.3F * direction(generator), direction(generator));
      ray /= std::max(std::abs(ray.x()), std::abs(ray.z()));
      scan.push_back({6.0F * ray, 1.0F});  // walls 6 m away
      const bool meets_box = with_box && ray.z() == -1.0F && std::abs(ray.x()) < 0.3F;
      if (meets_box) scan.back().position = 3.0F * ray;
    }
    return scan;
  };
  for (int id = 0; id < 5; ++id) {
    Keyframe keyframe;
    keyframe.id = id;
    for (LiveMap* map : {&carved, &plain}) map->add_keyframe(keyframe);
    for (int i = 0; i < 20; ++i) {
      const auto scan = scan_of_room(id == 0);
      for (LiveMap* map : {&carved, &plain}) map->insert_scan(scan, Pose{});
    }
  }
  // Higher up the rays are few.
  const auto count = [](const LiveMap& map, bool box) {
    std::size_t voxels = 0;
    for (const auto& [cell, point] : map.voxels().sorted(0)) {
      const bool is_box = std::max(std::abs(point.p_world.x()), std::abs(point.p_world.z())) < 4.0;
      voxels += is_box == box && std::abs(point.p_world.y()) < 0.75 ? 1U : 0U;
    }
    return voxels;
  };
  EXPECT_GT(count(plain, true), 50U);
  EXPECT_EQ(count(carved, true), 0U);
  EXPECT_EQ(count(carved, false), count(plain, false));
  EXPECT_EQ(carved.voxels().fingerprint(), rebuild(carved.as_drawn()).fingerprint());
}

}  // namespace
}  // namespace ignis
