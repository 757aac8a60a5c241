// SPDX-License-Identifier: Apache-2.0
#include "map/picture_builder.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace ignis {

TileGrid tile_grid(const MapConfig& config) {
  TileGrid grid;
  grid.cell_m = {config.local_cell_m, config.mid_cell_m, config.coarse_cell_m};
  for (std::size_t i = 0; i < kLevels; ++i) {
    grid.cells_per_tile[i] = 8 * static_cast<int>(std::lround(config.coarse_cell_m / grid.cell_m[i]));
  }
  return grid;
}

MapPicture picture_of(const ThreeLevelMap& map, const TileGrid& grid, double radius_m) {
  const MapView view = map.view(radius_m);
  MapPicture picture;
  picture.grid = grid;
  picture.radius_m = radius_m;
  std::map<CellIndex, TilePicture> tiles;
  for (std::size_t i = 0; i < kLevels; ++i) {
    picture.origins[i] = view[i].origin;
    const int n = grid.cells_per_tile[i];
    for (const ViewVoxel& voxel : view[i].voxels) {
      const CellIndex tile = parent_cell(voxel.cell, n);
      const int cell = ((voxel.cell.x - tile.x * n) * n + voxel.cell.y - tile.y * n) * n + voxel.cell.z - tile.z * n;
      TilePicture& target = tiles[tile];
      target.tile = tile;
      target.voxels[i].push_back(TileVoxel::pack(static_cast<std::uint32_t>(cell), voxel.intensity, voxel.live));
      target.heights[i].add(map.level(i).find(voxel.cell)->p_world.y());
    }
  }
  for (auto& [index, tile] : tiles) {
    for (auto& voxels : tile.voxels) std::ranges::sort(voxels);
    tile.checksum = checksum_of(tile, grid);
    picture.add(std::make_shared<const TilePicture>(std::move(tile)));
  }
  return picture;
}

}  // namespace ignis
