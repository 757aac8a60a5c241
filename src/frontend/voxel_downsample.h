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

/// At most `max_points` points of a cloud, evenly spread over its order.
[[nodiscard]] std::vector<CloudPoint> every_nth(std::span<const CloudPoint> cloud, int max_points);

}  // namespace ignis
