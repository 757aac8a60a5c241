// SPDX-License-Identifier: Apache-2.0
#include "map/tile_grid.h"

#include <cmath>

#include "map/map_config.h"

namespace ignis {
namespace {

constexpr int kCoarseCellsPerTile = 8;

}  // namespace

std::uint32_t TileGrid::cell_in_tile(std::size_t level, const CellIndex& tile, const CellIndex& cell) const {
  const int n = cells_per_tile[level];
  return static_cast<std::uint32_t>(((cell.x - tile.x * n) * n + (cell.y - tile.y * n)) * n + (cell.z - tile.z * n));
}

TileGrid tile_grid(const MapConfig& config) {
  TileGrid grid;
  grid.cell_m = {config.local_cell_m, config.mid_cell_m, config.coarse_cell_m};
  for (std::size_t i = 0; i < kLevels; ++i) {
    grid.cells_per_tile[i] = kCoarseCellsPerTile * static_cast<int>(std::lround(config.coarse_cell_m / grid.cell_m[i]));
  }
  return grid;
}

PointLocator::PointLocator(const TileGrid& grid)
    : grid_(grid), local_per_m_(1.0 / grid.cell_m[0]), tiles_per_local_(1.0 / grid.cells_per_tile[0]) {
  for (std::size_t from = 0; from < kLevels; ++from) {
    for (std::size_t to = from; to < kLevels; ++to) {
      const int ratio = grid.cells_per_tile[from] / grid.cells_per_tile[to];
      for (int cell = 0; cell < grid.cells_per_tile[from]; ++cell) {
        parents_[from][to].push_back(static_cast<std::uint32_t>(cell / ratio));
      }
    }
  }
}

CellIndex PointLocator::cell_of(std::size_t level, const Eigen::Vector3d& p_world) const {
  const Location location = locate(p_world);
  return grid_.world_cell(level, location.tile, cell_in_tile(level, location));
}

}  // namespace ignis
