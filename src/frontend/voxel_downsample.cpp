// SPDX-License-Identifier: Apache-2.0
#include "frontend/voxel_downsample.h"

#include <algorithm>
#include <bit>
#include <cstdint>

#include "common/grid.h"

namespace ignis {
namespace {

struct Cell {
  std::uint64_t key = 0;
  std::int32_t index = -1;  ///< into the result, -1 when free
  float distance2 = 0.0F;   ///< [m^2] of the kept point from the voxel's centre
};

/// 21 bits per axis: +-1 million voxels, far beyond any sensor's range.
std::uint64_t key_of(const Eigen::Vector3i& voxel) {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << 21) - 1;
  return (static_cast<std::uint64_t>(voxel.x()) & kMask) | ((static_cast<std::uint64_t>(voxel.y()) & kMask) << 21) |
         ((static_cast<std::uint64_t>(voxel.z()) & kMask) << 42);
}

/// Open addressing, at most half full. Begins small: a dense scan falls into few voxels, and a table that stays in the
/// cache is worth more than growing it now and then.
class CellTable {
 public:
  explicit CellTable(std::size_t points) : cells_(std::bit_ceil(std::min(2 * points, kFirstSize) + 2)) {}

  /// The cell of a voxel, free if the voxel is new. Valid until the next call.
  Cell& at(std::uint64_t key) {
    if (2 * used_ >= cells_.size()) grow();
    Cell& cell = cells_[slot_of(key)];
    if (cell.index < 0) ++used_;
    return cell;
  }

 private:
  static constexpr std::size_t kFirstSize = 1U << 14U;

  [[nodiscard]] std::size_t slot_of(std::uint64_t key) const {
    const std::size_t mask = cells_.size() - 1;
    std::size_t slot = static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ULL) >> 24) & mask;
    while (cells_[slot].index >= 0 && cells_[slot].key != key) slot = (slot + 1) & mask;
    return slot;
  }
  void grow() {
    std::vector<Cell> old(2 * cells_.size());
    old.swap(cells_);
    for (const Cell& cell : old) {
      if (cell.index >= 0) cells_[slot_of(cell.key)] = cell;
    }
  }

  std::vector<Cell> cells_;
  std::size_t used_ = 0;
};

template <class Point>
std::vector<Point> nearest_to_centres(std::span<const Point> cloud, double voxel_size_m) {
  CellTable table(cloud.size());
  const auto edge = static_cast<float>(voxel_size_m);
  const float per_metre = 1.0F / edge;
  std::vector<Point> kept;
  for (const Point& point : cloud) {
    const Eigen::Vector3i voxel = cell_of<float>(point.position * per_metre);
    const Eigen::Vector3f centre = edge * (voxel.cast<float>().array() + 0.5F);
    const float distance2 = (point.position - centre).squaredNorm();
    const std::uint64_t key = key_of(voxel);
    Cell& cell = table.at(key);
    if (cell.index < 0) {
      cell = {key, static_cast<std::int32_t>(kept.size()), distance2};
      kept.push_back(point);
    } else if (distance2 < cell.distance2) {
      cell.distance2 = distance2;
      kept[static_cast<std::size_t>(cell.index)] = point;
    }
  }
  return kept;
}

}  // namespace

std::vector<CloudPoint> voxel_downsample(std::span<const CloudPoint> cloud, double voxel_size_m) {
  return nearest_to_centres(cloud, voxel_size_m);
}

std::vector<ScanPoint> voxel_downsample(std::span<const ScanPoint> cloud, double voxel_size_m) {
  return nearest_to_centres(cloud, voxel_size_m);
}

std::vector<CloudPoint> every_nth(std::span<const CloudPoint> cloud, int max_points) {
  const auto bound = static_cast<std::size_t>(max_points);
  if (cloud.size() <= bound) return {cloud.begin(), cloud.end()};
  std::vector<CloudPoint> kept;
  kept.reserve(bound);
  // Bresenham's rule picks exactly `bound` points.
  for (std::size_t i = 0; i < bound; ++i) kept.push_back(cloud[i * cloud.size() / bound]);
  return kept;
}

}  // namespace ignis
