// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "common/grid.h"
#include "map/cell_index.h"

namespace ignis {

struct MapConfig;

inline constexpr std::size_t kLevels = 3;  ///< fine to coarse: local, mid, coarse

/// Coordinates beyond this cannot be told apart [m]; whoever inserts points refuses them.
inline constexpr double kMaxCoordinate = 10'000.0;

/// Whether a map can hold the point. Not by the largest coordinate: which one that is, is undefined when one is no
/// number.
[[nodiscard]] inline bool is_within_reach(const Eigen::Vector3d& p) { return (p.array().abs() < kMaxCoordinate).all(); }

/// How the world is cut: cells of three sizes that nest, and tiles, cubes that hold a whole number of cells of every
/// level. A cell within its tile is numbered with x slowest and z fastest.
struct TileGrid {
  std::array<double, kLevels> cell_m{};       ///< [m]
  std::array<int, kLevels> cells_per_tile{};  ///< along one edge

  [[nodiscard]] double tile_m() const { return cell_m[0] * cells_per_tile[0]; }

  /// Where in its tile the cell of a number lies, along each axis.
  [[nodiscard]] CellIndex split(std::size_t level, std::uint32_t cell_in_tile) const {
    // By multiplication: three divisions a voxel were most of what a picture cost. Half a unit away from every
    // multiple, no rounding can reach the wrong one.
    const int n = cells_per_tile[level];
    const double per_cell = 1.0 / n;
    const int rows = static_cast<int>((static_cast<double>(cell_in_tile) + 0.5) * per_cell);
    const int x = static_cast<int>((static_cast<double>(rows) + 0.5) * per_cell);
    return {x, rows - x * n, static_cast<int>(cell_in_tile) - rows * n};
  }

  /// The cell of the world that a number within a tile stands for.
  [[nodiscard]] CellIndex world_cell(std::size_t level, const CellIndex& tile, std::uint32_t cell_in_tile) const {
    const int n = cells_per_tile[level];
    const CellIndex cell = split(level, cell_in_tile);
    return {tile.x * n + cell.x, tile.y * n + cell.y, tile.z * n + cell.z};
  }

  /// Its number within its tile.
  [[nodiscard]] std::uint32_t cell_in_tile(std::size_t level, const CellIndex& tile, const CellIndex& cell) const;

  [[nodiscard]] Eigen::Vector3d centre_of(std::size_t level, const CellIndex& cell) const {
    return cell_m[level] * (Eigen::Vector3d(cell.x, cell.y, cell.z) + Eigen::Vector3d::Constant(0.5));
  }
};

/// Tiles of eight coarse cells along an edge.
[[nodiscard]] TileGrid tile_grid(const MapConfig& config);

/// Where a point lies: in which tile, and in which of its local cells along each axis. The coarser cells follow from
/// that (PointLocator).
struct Location {
  Eigen::Vector3d p_world;  ///< [m]
  CellIndex tile;
  std::array<std::uint32_t, 3> local{};
};

/// Finds the cells of points. The cell of a coarser level follows from that of the local one, so that cells nest
/// exactly whatever their sizes and the rounding. Where windows slide, most points are asked for on one level, if at
/// all.
class PointLocator {
 public:
  explicit PointLocator(const TileGrid& grid);

  [[nodiscard]] Location locate(const Eigen::Vector3d& p_world) const {
    const Axis x = along(p_world.x());
    const Axis y = along(p_world.y());
    const Axis z = along(p_world.z());
    return {p_world, {x.tile, y.tile, z.tile}, {x.local, y.local, z.local}};
  }

  /// Number of the point's cell within its tile.
  [[nodiscard]] std::uint32_t cell_in_tile(std::size_t level, const Location& location) const {
    const auto n = static_cast<std::uint32_t>(grid_.cells_per_tile[level]);
    const std::vector<std::uint32_t>& cell = parents_[0][level];
    return (cell[location.local[0]] * n + cell[location.local[1]]) * n + cell[location.local[2]];
  }

  /// Where the point lies from the centre of its cell [m].
  [[nodiscard]] Eigen::Vector3f from_centre(std::size_t level, const Location& location) const {
    const double n = grid_.cells_per_tile[level];
    const double cell_m = grid_.cell_m[level];
    const auto offset = [&](double p, std::int32_t tile, std::uint32_t local) {
      const double cell = static_cast<double>(tile) * n + parents_[0][level][local];
      return static_cast<float>(p - cell_m * (cell + 0.5));
    };
    return {offset(location.p_world.x(), location.tile.x, location.local[0]),
            offset(location.p_world.y(), location.tile.y, location.local[1]),
            offset(location.p_world.z(), location.tile.z, location.local[2])};
  }

  [[nodiscard]] CellIndex cell_of(std::size_t level, const Eigen::Vector3d& p_world) const;

  /// The number of the cell of level `to` that contains a cell of the finer level `from`, given as split() has it.
  [[nodiscard]] std::uint32_t parent_in_tile(std::size_t from, std::size_t to, const CellIndex& split) const {
    const std::vector<std::uint32_t>& parents = parents_[from][to];
    const auto m = static_cast<std::uint32_t>(grid_.cells_per_tile[to]);
    const auto of = [&](std::int32_t cell) { return parents[static_cast<std::size_t>(cell)]; };
    return (of(split.x) * m + of(split.y)) * m + of(split.z);
  }

 private:
  struct Axis {
    std::int32_t tile;
    std::uint32_t local;  // cell within the tile
  };

  [[nodiscard]] Axis along(double coordinate) const {
    const int local = floor_to_int(coordinate * local_per_m_);
    // Half a cell away from every multiple, so that no rounding can reach the wrong tile.
    const int tile = floor_to_int((static_cast<double>(local) + 0.5) * tiles_per_local_);
    const auto within = static_cast<std::uint32_t>(local - tile * grid_.cells_per_tile[0]);
    return {tile, within};
  }

  TileGrid grid_;
  double local_per_m_;
  double tiles_per_local_;
  // Along one axis of a tile: which cell of the second level, the same or a coarser one, contains a cell of the first.
  std::array<std::array<std::vector<std::uint32_t>, kLevels>, kLevels> parents_;
};

}  // namespace ignis
