// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/scan_instant.h"

#include <algorithm>

namespace ignis {

double mean_age(const Scan& scan) {
  if (scan.points.empty()) return 0.0;
  double sum = 0.0;
  for (const ScanPoint& point : scan.points) {
    sum += 1e-6 * (scan.duration_us - std::clamp(point.dt_us, 0, scan.duration_us));
  }
  return sum / static_cast<double>(scan.points.size());
}

bool is_of_one_instant(const Scan& scan) {
  if (scan.points.size() < 2 || scan.duration_us == 0) return false;
  const std::int32_t first = scan.points.front().dt_us;
  return std::ranges::all_of(scan.points, [first](const ScanPoint& point) { return point.dt_us == first; });
}

Scan with_times(Scan scan) {
  if (!is_of_one_instant(scan) || scan.points.front().dt_us != 0) return scan;
  for (ScanPoint& point : scan.points) point.dt_us = scan.duration_us;
  return scan;
}

double unseen_turn_variance(double gyro_noise, double seconds) { return gyro_noise * gyro_noise * seconds / 3.0; }

double velocity_variance(const ErrorCovariance& covariance) {
  return covariance.diagonal().segment<3>(kVelocity).sum();
}

double new_share(const ErrorCovariance& covariance, double mapped_velocity_variance) {
  return std::clamp(1.0 - mapped_velocity_variance / velocity_variance(covariance), 0.0, 1.0);
}

ErrorCovariance with_position_at(const ErrorCovariance& covariance, double seconds) {
  ErrorCovariance moved = covariance;
  moved.middleRows<3>(kPosition) += seconds * moved.middleRows<3>(kVelocity);
  moved.middleCols<3>(kPosition) += seconds * moved.middleCols<3>(kVelocity);
  return moved;
}

}  // namespace ignis
