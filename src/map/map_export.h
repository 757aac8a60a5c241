// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "map/three_level_map.h"

namespace ignis {

/// Writes every voxel's point (frame map, metres) with the fields x y z intensity level, in the order of levels,
/// tiles and cells, so that equal maps give equal files. Level 0 is the local one. A cell that a finer level shows too
/// is left out. The file appears under its name only when complete. Throws std::runtime_error that names the file.
void write_pcd(const std::filesystem::path& file, const ThreeLevelMap& map);
void write_ply(const std::filesystem::path& file, const ThreeLevelMap& map);

}  // namespace ignis
