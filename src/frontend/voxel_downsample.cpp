// SPDX-License-Identifier: Apache-2.0
#include "frontend/voxel_downsample.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

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

}  // namespace

std::vector<CloudPoint> voxel_downsample(std::span<const CloudPoint> cloud, double voxel_size_m) {
  std::vector<Cell> table(std::bit_ceil(2 * cloud.size() + 2));
  const std::size_t mask = table.size() - 1;
  const auto edge = static_cast<float>(voxel_size_m);
  std::vector<CloudPoint> kept;
  for (const CloudPoint& point : cloud) {
    const Eigen::Array3f index = (point.position / edge).array().floor();
    const float distance2 = (point.position - ((index + 0.5F) * edge).matrix()).squaredNorm();
    const std::uint64_t key = key_of(index.cast<int>().matrix());
    std::size_t slot = static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ULL) >> 24) & mask;
    while (table[slot].index >= 0 && table[slot].key != key) slot = (slot + 1) & mask;
    if (table[slot].index < 0) {
      table[slot] = {key, static_cast<std::int32_t>(kept.size()), distance2};
      kept.push_back(point);
    } else if (distance2 < table[slot].distance2) {
      table[slot].distance2 = distance2;
      kept[static_cast<std::size_t>(table[slot].index)] = point;
    }
  }
  return kept;
}

std::vector<CloudPoint> thin(std::span<const CloudPoint> cloud, double voxel_size_m, int max_points) {
  const auto bound = static_cast<std::size_t>(max_points);
  if (cloud.size() <= bound) return {cloud.begin(), cloud.end()};
  std::vector<CloudPoint> kept = voxel_downsample(cloud, voxel_size_m);
  if (kept.size() <= bound) return kept;
  // Bresenham's rule picks exactly `bound` points, evenly spread over the order of the scan.
  for (std::size_t i = 0; i < bound; ++i) kept[i] = kept[i * kept.size() / bound];
  kept.resize(bound);
  return kept;
}

}  // namespace ignis
