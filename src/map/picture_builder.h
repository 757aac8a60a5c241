// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "map/map_picture.h"
#include "map/three_level_map.h"

namespace ignis {

/// The tiles of a map with this configuration: eight coarse cells along an edge.
[[nodiscard]] TileGrid tile_grid(const MapConfig& config);

/// The voxels that a viewer of this radius sees.
[[nodiscard]] MapPicture picture_of(const ThreeLevelMap& map, const TileGrid& grid, double radius_m);

}  // namespace ignis
