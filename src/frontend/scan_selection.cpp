// SPDX-License-Identifier: Apache-2.0
#include "frontend/scan_selection.h"

#include "frontend/voxel_downsample.h"

namespace ignis {

ScanSelection select_points(const Scan& scan, const FrontendConfig& config) {
  const double nearest2 = config.min_range_m * config.min_range_m;
  const double farthest2 = config.max_range_m * config.max_range_m;
  ScanSelection selection;
  selection.scan.utime = scan.utime;
  selection.scan.sequence = scan.sequence;
  selection.scan.duration_us = scan.duration_us;
  selection.scan.missing_packets = scan.missing_packets;
  std::vector<ScanPoint>& points = selection.scan.points;
  points.reserve(scan.points.size());
  for (const ScanPoint& point : scan.points) {
    // False for what is not finite, too.
    const double range2 = point.position.cast<double>().squaredNorm();
    if (range2 >= nearest2 && range2 <= farthest2) points.push_back(point);
  }
  selection.in_range = static_cast<int>(points.size());
  if (config.scan_voxel_m > 0.0 && selection.in_range > config.max_scan_points) {
    points = voxel_downsample(std::span<const ScanPoint>(points), config.scan_voxel_m);
  }
  return selection;
}

}  // namespace ignis
