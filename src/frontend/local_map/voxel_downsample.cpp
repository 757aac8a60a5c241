// SPDX-License-Identifier: Apache-2.0
#include "frontend/local_map/voxel_downsample.h"

#include <algorithm>

namespace ignis {

std::vector<CloudPoint> voxel_downsample(std::span<const CloudPoint> cloud, double voxel_size_m) {
  VoxelThinner thinner;
  return voxel_downsample(cloud, voxel_size_m, thinner);
}

std::vector<CloudPoint> voxel_downsample(std::span<const CloudPoint> cloud, double voxel_size_m,
                                         VoxelThinner& thinner) {
  const std::span<const VoxelThinner::Picked> picked = thinner.pick(cloud, voxel_size_m);
  std::vector<CloudPoint> kept;
  kept.reserve(picked.size());
  for (const VoxelThinner::Picked& each : picked) kept.push_back(cloud[static_cast<std::size_t>(each.point)]);
  return kept;
}

void every_nth(std::span<const CloudPoint> cloud, int max_points, std::vector<Eigen::Vector3f>& positions) {
  const std::size_t bound = std::min(static_cast<std::size_t>(max_points), cloud.size());
  positions.clear();
  positions.reserve(bound);
  // Bresenham's rule picks exactly `bound` points.
  for (std::size_t i = 0; i < bound; ++i) positions.push_back(cloud[i * cloud.size() / bound].position);
}

}  // namespace ignis
