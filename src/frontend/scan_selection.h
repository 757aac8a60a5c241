// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/measurements.h"
#include "frontend/frontend_config.h"

namespace ignis {

/// The points of a scan that are worked with.
struct ScanSelection {
  Scan scan;         ///< each point as measured, with its own instant
  int in_range = 0;  ///< points that were finite and within min_range_m .. max_range_m
};

/// Drops what is not finite or out of range. A scan that still has more than max_scan_points is then thinned to one
/// point per voxel of scan_voxel_m (0: not at all), before anything is spent on its points: at 130,000 a scan, moving
/// each of them to the scan's end and into the map costs more than matching.
[[nodiscard]] ScanSelection select_points(const Scan& scan, const FrontendConfig& config);

}  // namespace ignis
