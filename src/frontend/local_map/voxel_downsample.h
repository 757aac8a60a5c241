// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "common/measurements.h"
#include "frontend/local_map/voxel_thinner.h"

namespace ignis {

/// One point per cubic voxel of the cloud's own frame: the one nearest the voxel's centre. Order of first appearance.
/// Positions must be finite.
[[nodiscard]] std::vector<CloudPoint> voxel_downsample(std::span<const CloudPoint> cloud, double voxel_size_m);
/// The same with the memory of a thinner that serves a stream of clouds.
[[nodiscard]] std::vector<CloudPoint> voxel_downsample(std::span<const CloudPoint> cloud, double voxel_size_m,
                                                       VoxelThinner& thinner);

/// Replaces `positions` by those of at most `max_points` points of a cloud, evenly spread over its order.
void every_nth(std::span<const CloudPoint> cloud, int max_points, std::vector<Eigen::Vector3f>& positions);

}  // namespace ignis
