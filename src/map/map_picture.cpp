// SPDX-License-Identifier: Apache-2.0
#include "map/map_picture.h"

#include <algorithm>

#include "map/voxel_checksum.h"

namespace ignis {
namespace {

using Changes = std::array<std::vector<VoxelChange>, kLevels>;

VoxelChange change_of(const TileGrid& grid, std::size_t level, const CellIndex& tile, std::uint64_t voxel, bool gone) {
  return {grid.world_cell(level, tile, TileVoxel::cell(voxel)), TileVoxel::intensity(voxel), TileVoxel::live(voxel),
          gone};
}

void add_all(const TilePicture& tile, const TileGrid& grid, bool gone, Changes& changes) {
  for (std::size_t i = 0; i < kLevels; ++i) {
    for (const std::uint64_t voxel : tile.voxels[i]) {
      changes[i].push_back(change_of(grid, i, tile.tile, voxel, gone));
    }
  }
}

void add_difference(const TilePicture& older, const TilePicture& newer, const TileGrid& grid, Changes& changes) {
  for (std::size_t i = 0; i < kLevels; ++i) {
    auto before = older.voxels[i].begin();
    auto after = newer.voxels[i].begin();
    while (before != older.voxels[i].end() || after != newer.voxels[i].end()) {
      const bool only_before = after == newer.voxels[i].end() ||
                               (before != older.voxels[i].end() && TileVoxel::cell(*before) < TileVoxel::cell(*after));
      const bool only_after = before == older.voxels[i].end() ||
                              (after != newer.voxels[i].end() && TileVoxel::cell(*after) < TileVoxel::cell(*before));
      if (only_before) {
        changes[i].push_back(change_of(grid, i, older.tile, *before++, true));
      } else if (only_after) {
        changes[i].push_back(change_of(grid, i, newer.tile, *after++, false));
      } else {
        if (*before != *after) changes[i].push_back(change_of(grid, i, newer.tile, *after, false));
        ++before;
        ++after;
      }
    }
  }
}

}  // namespace

void HeightRange::add(double height) {
  min = std::min(min, height);
  max = std::max(max, height);
}

void HeightRange::add(const HeightRange& other) {
  min = std::min(min, other.min);
  max = std::max(max, other.max);
}

std::uint64_t checksum_of(const TilePicture& picture, const TileGrid& grid) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < kLevels; ++i) {
    for (const std::uint64_t voxel : picture.voxels[i]) {
      sum += voxel_checksum(i, grid.world_cell(i, picture.tile, TileVoxel::cell(voxel)), TileVoxel::intensity(voxel),
                            TileVoxel::live(voxel));
    }
  }
  return sum;
}

void MapPicture::add(SharedTilePicture tile) {
  if (tile->empty()) return;
  for (std::size_t i = 0; i < kLevels; ++i) {
    counts[i] += static_cast<std::uint32_t>(tile->voxels[i].size());
    heights[i].add(tile->heights[i]);
  }
  checksum += tile->checksum;
  tiles.push_back(std::move(tile));
}

Changes difference(const MapPicture& older, const MapPicture& newer) {
  Changes changes;
  auto before = older.tiles.begin();
  auto after = newer.tiles.begin();
  while (before != older.tiles.end() || after != newer.tiles.end()) {
    const bool only_before =
        after == newer.tiles.end() || (before != older.tiles.end() && (*before)->tile < (*after)->tile);
    const bool only_after =
        before == older.tiles.end() || (after != newer.tiles.end() && (*after)->tile < (*before)->tile);
    if (only_before) {
      add_all(**before++, newer.grid, true, changes);
    } else if (only_after) {
      add_all(**after++, newer.grid, false, changes);
    } else {
      if (*before != *after) add_difference(**before, **after, newer.grid, changes);
      ++before;
      ++after;
    }
  }
  return changes;
}

}  // namespace ignis
