// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "common/pose.h"
#include "common/time.h"
#include "map/cell_index.h"
#include "map/tile_grid.h"

namespace ignis {

/// A voxel inside its tile, packed so that sorting by the number sorts by the cell: cell within the tile (x slowest, z
/// fastest), intensity, live flag.
struct TileVoxel {
  static constexpr std::uint64_t pack(std::uint32_t cell, std::uint8_t intensity, bool live) {
    return std::uint64_t{cell} << 16 | std::uint64_t{intensity} << 8 | (live ? 1U : 0U);
  }
  static constexpr std::uint32_t cell(std::uint64_t packed) { return static_cast<std::uint32_t>(packed >> 16); }
  static constexpr std::uint8_t intensity(std::uint64_t packed) { return static_cast<std::uint8_t>(packed >> 8); }
  static constexpr bool live(std::uint64_t packed) { return (packed & 1) != 0; }
};

/// Lowest and highest point of some voxels, world Y [m]. Empty: min > max.
struct HeightRange {
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();

  void add(double height);
  void add(const HeightRange& other);
  auto operator<=>(const HeightRange&) const = default;
};

/// What a view shows of one tile. Immutable, so that pictures, threads and viewers share it.
struct TilePicture {
  CellIndex tile;
  std::array<std::vector<std::uint64_t>, kLevels> voxels;  ///< TileVoxel, ascending
  std::array<HeightRange, kLevels> heights;
  std::uint64_t checksum = 0;

  [[nodiscard]] bool empty() const { return voxels[0].empty() && voxels[1].empty() && voxels[2].empty(); }
  bool operator==(const TilePicture&) const = default;
};
using SharedTilePicture = std::shared_ptr<const TilePicture>;

/// Sum of voxel_checksum over the tile's voxels.
[[nodiscard]] std::uint64_t checksum_of(const TilePicture& picture, const TileGrid& grid);

/// One loop between two keyframes, at their corrected positions [m, map].
struct LoopEdge {
  Eigen::Vector3f from;
  Eigen::Vector3f to;
  std::int32_t from_id = 0;
  std::int32_t to_id = 0;
  bool operator==(const LoopEdge&) const = default;
};

using SharedPath = std::shared_ptr<const std::vector<Eigen::Vector3f>>;
using SharedLoopEdges = std::shared_ptr<const std::vector<LoopEdge>>;

/// Everything that viewers of one radius see at one instant. Equal parts of two pictures are the same objects, so that
/// the difference of two pictures costs only what differs.
struct MapPicture {
  std::int64_t number = 0;    ///< +1 per instant at which pictures were made
  Utime utime = 0;            ///< [us] of the newest cloud
  std::int32_t revision = 0;  ///< of the graph that the voxels stand on
  double radius_m = 0.0;
  Pose T_map_body;
  TileGrid grid;
  std::array<CellIndex, kLevels> origins;  ///< per level, the cell of the windows' centre
  std::vector<SharedTilePicture> tiles;    ///< ascending by tile, none empty
  std::array<std::uint32_t, kLevels> counts{};
  std::array<HeightRange, kLevels> heights;
  std::uint64_t checksum = 0;
  SharedPath odometry_path;   ///< [m] as odometry saw it
  SharedPath corrected_path;  ///< [m] map
  SharedLoopEdges loop_edges;

  /// Appends a tile and counts it in. Tiles come in ascending order.
  void add(SharedTilePicture tile);
};
using SharedPicture = std::shared_ptr<const MapPicture>;

/// A voxel that one of two pictures shows and the other does not, or shows differently.
struct VoxelChange {
  CellIndex cell;
  std::uint8_t intensity = 0;
  bool live = false;
  bool gone = false;  ///< the newer picture shows nothing in this cell
};

/// What turns the voxels of `older` into those of `newer`, per level.
[[nodiscard]] std::array<std::vector<VoxelChange>, kLevels> difference(const MapPicture& older,
                                                                       const MapPicture& newer);

}  // namespace ignis
