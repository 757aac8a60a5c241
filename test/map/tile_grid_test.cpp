// SPDX-License-Identifier: Apache-2.0
#include "map/tile_grid.h"

#include <algorithm>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "map/map_config.h"
#include "map/map_oracle.h"
#include "map/voxel.h"
#include "map/windows.h"

namespace ignis {
namespace {

using test::cell_centre;
using test::floor_cell;

std::vector<Eigen::Vector3d> random_points(std::uint32_t seed, std::size_t count, double reach) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> coordinate(-reach, reach);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.emplace_back(coordinate(generator), coordinate(generator), coordinate(generator));
  }
  return points;
}

TEST(PointLocator, FindsTheCellsThatTheDefinitionGives) {
  const TileGrid grid = tile_grid(MapConfig{});
  const PointLocator locator(grid);
  for (const double reach : {1.0, 30.0, 9'999.0}) {
    for (const Eigen::Vector3d& p : random_points(1, 5'000, reach)) {
      const Location location = locator.locate(p);
      EXPECT_EQ(location.tile, floor_cell(p, 4.0));
      for (std::size_t i = 0; i < kLevels; ++i) {
        const CellIndex cell = grid.world_cell(i, location.tile, locator.cell_in_tile(i, location));
        ASSERT_EQ(cell, floor_cell(p, grid.cell_m[i]));
        EXPECT_EQ(grid.cell_in_tile(i, location.tile, cell), locator.cell_in_tile(i, location));
        EXPECT_LT((cell_centre(cell, grid.cell_m[i]) + locator.from_centre(i, location).cast<double>() - p).norm(),
                  1e-6);
      }
    }
  }
}

TEST(PointLocator, PutsPointsOnBordersIntoNestedCellsWhateverTheSizes) {
  MapConfig config;
  config.local_cell_m = 0.1;
  config.mid_cell_m = 0.3;
  config.coarse_cell_m = 1.5;
  const TileGrid grid = tile_grid(config);
  const PointLocator locator(grid);
  for (int i = -500; i <= 500; ++i) {
    const Eigen::Vector3d p(0.1 * i, -0.3 * i, 1.5 * i);
    for (const double nudge : {-1e-9, 0.0, 1e-9}) {
      const Location location = locator.locate(p + Eigen::Vector3d::Constant(nudge));
      for (std::size_t k = 0; k < kLevels; ++k) {
        const int n = grid.cells_per_tile[k];
        ASSERT_LT(locator.cell_in_tile(k, location), static_cast<std::uint32_t>(n * n * n));
        EXPECT_LT(locator.from_centre(k, location).cwiseAbs().maxCoeff(), 0.5 * grid.cell_m[k] + 1e-6);
      }
      EXPECT_EQ(locator.parent_in_tile(0, 1, grid.split(0, locator.cell_in_tile(0, location))),
                locator.cell_in_tile(1, location));
      EXPECT_EQ(locator.parent_in_tile(0, 2, grid.split(0, locator.cell_in_tile(0, location))),
                locator.cell_in_tile(2, location));
      EXPECT_EQ(locator.parent_in_tile(1, 2, grid.split(1, locator.cell_in_tile(1, location))),
                locator.cell_in_tile(2, location));
    }
  }
}

TEST(PackedCell, KeepsCellsApartAtTheFinestCellAndTheLargestCoordinate) {
  std::set<CellKey> keys;
  const int edge = static_cast<int>(kMaxCoordinate / 0.01) - 1;
  for (const int x : {-edge - 1, -1, 0, 1, edge}) {
    for (const int y : {-edge - 1, -1, 0, 1, edge}) {
      for (const int z : {-edge - 1, -1, 0, 1, edge}) keys.insert(pack({x, y, z}));
    }
  }
  EXPECT_EQ(keys.size(), 125U);
}

TEST(ParentCell, RoundsDownAlsoBelowZero) {
  for (std::int32_t x = -9; x <= 9; ++x) {
    const CellIndex child{x, -x, 2 * x + 1};
    EXPECT_EQ(parent_cell(child, 4), floor_cell(cell_centre(child, 0.125), 0.5));
  }
}

TEST(Voxel, StandingBeforeIsATotalOrder) {
  std::mt19937 generator(2);
  std::vector<Voxel> voxels;
  for (int i = 0; i < 60; ++i) {
    // Few values, so that all ties occur.
    const auto coordinate = [&] { return 0.01F * static_cast<float>(static_cast<int>(generator() % 3) - 1); };
    const float x = coordinate();
    const float y = coordinate();
    const float z = coordinate();
    voxels.push_back({{x, y, z}, static_cast<float>(generator() % 2), static_cast<std::int32_t>(generator() % 2)});
  }
  const auto equal = [](const Voxel& a, const Voxel& b) {
    return a.from_centre == b.from_centre && a.intensity == b.intensity && a.keyframe_id == b.keyframe_id;
  };
  for (const Voxel& a : voxels) {
    for (const Voxel& b : voxels) {
      EXPECT_EQ(stands_before(a, b) + stands_before(b, a), equal(a, b) ? 0 : 1);
      for (const Voxel& c : voxels) {
        if (stands_before(a, b) && stands_before(b, c)) {
          EXPECT_TRUE(stands_before(a, c));
        }
      }
    }
  }
}

TEST(Windows, ReachOfATileIsWhatItsCellsSay) {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> coordinate(-9.0, 9.0);
  std::array<int, 3> seen{};
  for (int round = 0; round < 3'000; ++round) {
    Windows windows;
    windows.centre = {coordinate(generator), coordinate(generator), coordinate(generator)};
    windows.height_m = 5.0;
    const double radius = 6.0;
    const CellIndex tile{static_cast<int>(generator() % 5) - 2, static_cast<int>(generator() % 5) - 2, 0};
    const Reach reach = windows.reach(radius, tile_box(tile, 4.0));
    ++seen[static_cast<std::size_t>(reach)];
    bool any = false;
    bool all = true;
    for (int cell = 0; cell < 512; ++cell) {
      const CellIndex index{8 * tile.x + cell / 64, 8 * tile.y + cell / 8 % 8, 8 * tile.z + cell % 8};
      const bool inside = windows.contains(radius, cell_centre(index, 0.5));
      any = any || inside;
      all = all && inside;
    }
    if (reach == Reach::kOutside) {
      EXPECT_FALSE(any);
    }
    if (reach == Reach::kInside) {
      EXPECT_TRUE(all);
    }
  }
  for (const int count : seen) EXPECT_GT(count, 50);
  EXPECT_EQ(Windows{}.reach(-1.0, tile_box({0, 0, 0}, 4.0)), Reach::kOutside);
}

}  // namespace
}  // namespace ignis
