// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "common/measurements.h"
#include "frontend/frontend_config.h"
#include "frontend/local_map/voxel_thinner.h"

namespace ignis {

/// The points of a scan that are worked with.
struct ScanSelection {
  Scan scan;         ///< each point as measured, with its own instant
  int in_range = 0;  ///< points that were finite and within min_range_m .. max_range_m
  int unread = 0;    ///< points of a scan that is far too large that were not looked at
};

/// Drops what is not finite or out of range. A scan that still has more than max_scan_points is then thinned to one
/// point per voxel of scan_voxel_m (0: not at all), before anything is spent on its points: at 130,000 a scan, moving
/// each of them to the scan's end and into the map costs more than matching. Of more than a million points, or of
/// 150,000 where none are thinned, some are looked at, evenly, so that the cost of a scan is bounded. Keeps its memory
/// from scan to scan.
class ScanSelector {
 public:
  /// Of `config`, the four fields named above.
  explicit ScanSelector(const FrontendConfig& config);

  /// Valid until the next call.
  [[nodiscard]] const ScanSelection& select(const Scan& scan);

 private:
  /// All of them, or of too many some, evenly.
  [[nodiscard]] std::span<const ScanPoint> bounded(std::span<const ScanPoint> points);

  double nearest2_;   ///< [m^2]
  double farthest2_;  ///< [m^2]
  double voxel_;      ///< [m]
  int max_points_;
  VoxelThinner thinner_;
  std::vector<ScanPoint> sampled_;
  ScanSelection selection_;
};

}  // namespace ignis
