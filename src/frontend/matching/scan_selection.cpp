// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/scan_selection.h"

namespace ignis {
namespace {

// At most 30 ms of work, whatever arrives: a point that is thinned away costs 26 ns, one that is moved and mapped 180.
constexpr std::size_t kMostToThin = 1'000'000;
constexpr std::size_t kMostToKeep = 150'000;

}  // namespace

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
  const std::span<const ScanPoint> read = bounded(scan.points);
  selection_.unread = static_cast<int>(scan.points.size() - read.size());
  const auto is_in_range = [&](const ScanPoint& point) {
    const double range2 = point.position.cast<double>().squaredNorm();
    const bool yes = range2 >= nearest2_ && range2 <= farthest2_;  // no for what is not finite, too
    selection_.in_range += yes ? 1 : 0;
    return yes;
  };
  std::vector<ScanPoint>& points = selection_.scan.points;
  points.clear();
  if (voxel_ > 0.0 && std::ssize(read) > max_points_) {
    const auto picked = thinner_.pick(read, voxel_, is_in_range);
    if (selection_.in_range > max_points_) {
      for (const VoxelThinner::Picked& each : picked) points.push_back(read[static_cast<std::size_t>(each.point)]);
      return selection_;
    }
    selection_.in_range = 0;  // few enough without thinning: from the beginning
  }
  for (const ScanPoint& point : read) {
    if (is_in_range(point)) points.push_back(point);
  }
  return selection_;
}

std::span<const ScanPoint> ScanSelector::bounded(std::span<const ScanPoint> points) {
  const std::size_t most = voxel_ > 0.0 ? kMostToThin : kMostToKeep;
  if (points.size() <= most) return points;
  // By a fraction: where points come column by column, a whole step would leave out the same beams again and again.
  sampled_.clear();
  for (std::size_t i = 0; i < most; ++i) sampled_.push_back(points[i * points.size() / most]);
  return sampled_;
}

}  // namespace ignis
