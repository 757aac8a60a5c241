// SPDX-License-Identifier: Apache-2.0
#include "frontend/scan_selection.h"

namespace ignis {

ScanSelector::ScanSelector(const FrontendConfig& config)
    : nearest2_(config.min_range_m * config.min_range_m),
      farthest2_(config.max_range_m * config.max_range_m),
      voxel_(config.scan_voxel_m),
      max_points_(config.max_scan_points) {}

const ScanSelection& ScanSelector::select(const Scan& scan) {
  selection_.scan.utime = scan.utime;
  selection_.scan.sequence = scan.sequence;
  selection_.scan.duration_us = scan.duration_us;
  selection_.scan.missing_packets = scan.missing_packets;
  selection_.in_range = 0;
  const auto is_in_range = [&](const ScanPoint& point) {
    const double range2 = point.position.cast<double>().squaredNorm();
    const bool yes = range2 >= nearest2_ && range2 <= farthest2_;  // no for what is not finite, too
    selection_.in_range += yes ? 1 : 0;
    return yes;
  };
  std::vector<ScanPoint>& points = selection_.scan.points;
  points.clear();
  if (voxel_ > 0.0 && std::ssize(scan.points) > max_points_) {
    const auto picked = thinner_.pick(std::span<const ScanPoint>(scan.points), voxel_, is_in_range);
    if (selection_.in_range > max_points_) {
      for (const VoxelThinner::Picked& each : picked)
        points.push_back(scan.points[static_cast<std::size_t>(each.point)]);
      return selection_;
    }
    selection_.in_range = 0;  // few enough without thinning: from the beginning
  }
  for (const ScanPoint& point : scan.points) {
    if (is_in_range(point)) points.push_back(point);
  }
  return selection_;
}

}  // namespace ignis
