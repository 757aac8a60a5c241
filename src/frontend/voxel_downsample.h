// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "common/measurements.h"

namespace ignis {

/// One point per cubic voxel of the cloud's own frame: the one nearest the voxel's centre. Order of first appearance.
/// Positions must be finite.
[[nodiscard]] std::vector<CloudPoint> voxel_downsample(std::span<const CloudPoint> cloud, double voxel_size_m);
[[nodiscard]] std::vector<ScanPoint> voxel_downsample(std::span<const ScanPoint> cloud, double voxel_size_m);

/// The cloud itself when it has at most `max_points`; otherwise voxel-downsampled, then every n-th point of that.
[[nodiscard]] std::vector<CloudPoint> thin(std::span<const CloudPoint> cloud, double voxel_size_m, int max_points);

}  // namespace ignis
