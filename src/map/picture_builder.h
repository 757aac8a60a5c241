// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <boost/unordered/unordered_flat_map.hpp>

#include "map/map_picture.h"
#include "map/three_level_map.h"

namespace ignis {

/// Makes the pictures of one view radius. The local level is shown in full; of the mid and coarse levels the cells
/// whose centre lies within the radius (horizontally), and only where no voxel of a finer level is shown inside the
/// cell.
///
/// What a tile shows depends on its voxels, and on the windows' centre only where a rim passes through it. All other
/// tiles are taken over from the picture before, so a picture costs what has changed since.
class PictureBuilder {
 public:
  explicit PictureBuilder(double radius_m) : radius_m_(radius_m) {}

  /// The voxels that a viewer sees; the caller adds pose, paths and numbers.
  [[nodiscard]] MapPicture build(const ThreeLevelMap& map);

 private:
  struct Cached {
    std::uint64_t version = 0;
    std::array<Reach, kLevels> reach{};
    Eigen::Vector3d centre;  // of the windows, when a rim passes through
    SharedTilePicture picture;
    std::uint64_t build = 0;  // in which it was last used
  };

  [[nodiscard]] static bool is_current(const Cached& cached, const Tile& tile, const std::array<Reach, kLevels>& reach,
                                       const Eigen::Vector3d& centre);
  [[nodiscard]] TilePicture show(const ThreeLevelMap& map, const Tile& tile, const std::array<Reach, kLevels>& reach,
                                 const std::array<double, kLevels>& radii);

  double radius_m_;
  boost::unordered_flat_map<CellKey, Cached> cache_;
  std::uint64_t builds_ = 0;
  // Scratch of one tile: cells that a finer voxel covers; the voxels by cell, and which cells have one.
  std::array<std::vector<std::uint8_t>, kLevels> covered_;
  std::vector<std::uint64_t> by_cell_;
  std::vector<std::uint64_t> occupied_;
};

}  // namespace ignis
