// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <random>

#include "map/map_picture.h"

namespace ignis::test {

/// A view as a plain table, level and cell to (intensity, live): what pictures must agree with.
struct ViewTable {
  std::map<std::pair<std::size_t, CellIndex>, std::pair<std::uint8_t, bool>> voxels;

  bool operator==(const ViewTable&) const = default;
};

inline TileGrid default_grid() { return {{0.125, 0.25, 0.5}, {32, 16, 8}}; }

/// Voxels spread over the tiles around `origin` (a tile index).
inline ViewTable random_view(std::mt19937& generator, std::size_t count, const CellIndex& origin) {
  const TileGrid grid = default_grid();
  ViewTable view;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t level = generator() % kLevels;
    const int n = grid.cells_per_tile[level];
    const auto axis = [&](std::int32_t tile) {
      return (tile - 1) * n + static_cast<int>(generator() % static_cast<unsigned>(3 * n));
    };
    const CellIndex cell{axis(origin.x), axis(origin.y), axis(origin.z)};
    view.voxels[{level, cell}] = {static_cast<std::uint8_t>(generator()), generator() % 2 == 0};
  }
  return view;
}

/// The picture of a table; tiles that equal those of `before` are the same objects.
inline MapPicture picture_of(const ViewTable& view, const CellIndex& origin_tile, const MapPicture* before = nullptr) {
  const TileGrid grid = default_grid();
  std::map<CellIndex, TilePicture> tiles;
  for (const auto& [where, what] : view.voxels) {
    const auto& [level, cell] = where;
    const int n = grid.cells_per_tile[level];
    const CellIndex tile = parent_cell(cell, n);
    const int number = ((cell.x - tile.x * n) * n + cell.y - tile.y * n) * n + cell.z - tile.z * n;
    tiles[tile].tile = tile;
    tiles[tile].voxels[level].push_back(TileVoxel::pack(static_cast<std::uint32_t>(number), what.first, what.second));
    tiles[tile].heights[level].add(grid.cell_m[level] * cell.y);
  }
  MapPicture picture;
  picture.grid = grid;
  for (std::size_t i = 0; i < kLevels; ++i) {
    const int n = grid.cells_per_tile[i];
    picture.origins[i] = {origin_tile.x * n, origin_tile.y * n, origin_tile.z * n};
  }
  for (auto& [index, tile] : tiles) {
    for (auto& voxels : tile.voxels) std::ranges::sort(voxels);
    tile.checksum = checksum_of(tile, grid);
    SharedTilePicture shared = std::make_shared<const TilePicture>(tile);
    if (before != nullptr) {
      for (const SharedTilePicture& old : before->tiles) {
        if (*old == tile) shared = old;
      }
    }
    picture.add(std::move(shared));
  }
  return picture;
}

}  // namespace ignis::test
