// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>

#include "common/grid.h"
#include "frontend/local_map/local_map.h"

/// How the parts of LocalMap find their way from regions to blocks to rows of voxels.
namespace ignis::cubes {

inline constexpr int kEdgeBits = 2;  // voxels in cubes of 4x4x4 are blocks, blocks in such cubes are regions

/// masks[axis][lo][hi]: the cells of a 4x4x4 cube whose coordinate along `axis` is in lo..hi.
using AxisMasks = std::array<std::array<std::array<std::uint64_t, 4>, 4>, 3>;

[[nodiscard]] constexpr AxisMasks make_axis_masks() {
  AxisMasks masks{};
  for (int bit = 0; bit < 64; ++bit) {
    const std::array<int, 3> at = {bit & 3, (bit >> 2) & 3, bit >> 4};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (int lo = 0; lo < 4; ++lo) {
        for (int hi = lo; hi < 4; ++hi) {
          if (at[axis] >= lo && at[axis] <= hi) {
            masks[axis][static_cast<std::size_t>(lo)][static_cast<std::size_t>(hi)] |= std::uint64_t{1} << bit;
          }
        }
      }
    }
  }
  return masks;
}

inline constexpr AxisMasks kAxisMasks = make_axis_masks();

/// The voxel that a point lies in.
[[nodiscard]] inline Eigen::Vector3i voxel_of(const Eigen::Vector3d& point, double voxel_size) {
  return cell_of<double>(point / voxel_size);
}

/// The mask along one axis of the cells lo..hi (global indices) inside the cube `cube`.
[[nodiscard]] inline std::uint64_t axis_mask(std::size_t axis, int cube, int lo, int hi) {
  const int first = std::max(lo - (cube << kEdgeBits), 0);
  const int last = std::min(hi - (cube << kEdgeBits), 3);
  return kAxisMasks[axis][static_cast<std::size_t>(first)][static_cast<std::size_t>(last)];
}

/// The mask of the cells in the box lo..hi inside the cube at `cube`, which the box meets.
[[nodiscard]] inline std::uint64_t box_mask(const Eigen::Vector3i& cube, const Eigen::Vector3i& lo,
                                            const Eigen::Vector3i& hi) {
  return axis_mask(0, cube.x(), lo.x(), hi.x()) & axis_mask(1, cube.y(), lo.y(), hi.y()) &
         axis_mask(2, cube.z(), lo.z(), hi.z());
}

/// The cube that a cell lies in.
[[nodiscard]] inline Eigen::Vector3i cube_of(const Eigen::Vector3i& cell) {
  return {cell.x() >> kEdgeBits, cell.y() >> kEdgeBits, cell.z() >> kEdgeBits};
}

/// The bit of a cell within its cube.
[[nodiscard]] inline int bit_of(const Eigen::Vector3i& inside) {
  return inside.x() + 4 * (inside.y() + 4 * inside.z());
}

}  // namespace ignis::cubes

namespace ignis {

inline std::size_t LocalMap::slot_of(const Eigen::Vector3i& coordinate) const {
  // Three large primes spread neighbouring regions; the high bits of the product are the well-mixed ones.
  const auto x = static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate.x()));
  const auto y = static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate.y()));
  const auto z = static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate.z()));
  const std::uint64_t hash = (x * 0x9E3779B97F4A7C15ULL) ^ (y * 0xC2B2AE3D27D4EB4FULL) ^ (z * 0x165667B19E3779F9ULL);
  return static_cast<std::size_t>((hash ^ (hash >> 29)) * 0xBF58476D1CE4E5B9ULL >> 20) & (table_.size() - 1);
}

inline const LocalMap::Region* LocalMap::find_region(const Eigen::Vector3i& coordinate) const {
  for (std::size_t slot = slot_of(coordinate);; slot = (slot + 1) & (table_.size() - 1)) {
    const std::int32_t index = table_[slot];
    if (index < 0) return nullptr;
    const Region& region = regions_[static_cast<std::size_t>(index)];
    if (region.coordinate == coordinate) return &region;
  }
}

inline LocalMap::Box LocalMap::box_around(const Eigen::Vector3d& query, double radius) const {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(radius);
  return {cubes::voxel_of(query - reach, voxel_size_), cubes::voxel_of(query + reach, voxel_size_)};
}

inline Eigen::Vector3f LocalMap::relative_to(const Block& block, const Eigen::Vector3d& query) const {
  return (query - kEdge * voxel_size_ * block.coordinate.cast<double>()).cast<float>();
}

void LocalMap::for_each_block(const Box& box, auto&& visit) const {
  const Eigen::Vector3i block_lo = cubes::cube_of(box.lo);
  const Eigen::Vector3i block_hi = cubes::cube_of(box.hi);
  const Eigen::Vector3i region_lo = cubes::cube_of(block_lo);
  const Eigen::Vector3i region_hi = cubes::cube_of(block_hi);
  Eigen::Vector3i at;
  for (at.z() = region_lo.z(); at.z() <= region_hi.z(); ++at.z()) {
    for (at.y() = region_lo.y(); at.y() <= region_hi.y(); ++at.y()) {
      for (at.x() = region_lo.x(); at.x() <= region_hi.x(); ++at.x()) {
        const Region* region = find_region(at);
        if (region == nullptr) continue;
        const std::uint64_t mask = cubes::box_mask(at, block_lo, block_hi);
        for (int face = 0; face < kFaces; ++face) {
          for (std::uint64_t left = region->present[face] & mask; left != 0; left &= left - 1) {
            visit(blocks_[static_cast<std::size_t>(region->blocks[face][std::countr_zero(left)])]);
          }
        }
      }
    }
  }
}

void LocalMap::for_each_row(const Block& block, const Box& box, auto&& visit) {
  std::uint64_t voxels = block.confirmed & cubes::box_mask(block.coordinate, box.lo, box.hi);
  while (voxels != 0) {
    const int row = std::countr_zero(voxels) / kEdge;
    visit(block.rows[row], static_cast<std::uint32_t>(voxels >> (kEdge * row) & 0xFU));
    voxels &= ~(std::uint64_t{0xF} << (kEdge * row));
  }
}

}  // namespace ignis
