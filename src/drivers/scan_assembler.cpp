// SPDX-License-Identifier: Apache-2.0
#include "drivers/scan_assembler.h"

#include <cmath>

namespace ignis::l1 {

namespace {

constexpr double kOverdueUs = 20'000.0;

}  // namespace

std::vector<Scan> ScanAssembler::add(std::int64_t count, double time_us, const std::vector<BodyPoint>& points) {
  std::vector<Scan> ended;
  if (open_ && scan_of(count) != scan_) ended.push_back(close(end_of_scan()));
  if (!open_) {
    open_ = true;
    scan_ = scan_of(count);
    // Nothing is missing before the very first packet: the driver was not listening.
    first_count_ = ever_opened_ ? scan_ * packets_per_scan_ : count;
    ever_opened_ = true;
    first_time_us_ = time_us;
    packets_ = 0;
  }
  ++packets_;
  newest_count_ = count;
  newest_time_us_ = time_us;
  for (const BodyPoint& point : points) {
    points_.push_back({time_us + point.index * kPointPeriodUs, point.position, point.intensity});
  }
  if (count == end_of_scan() - 1) ended.push_back(close(end_of_scan()));
  return ended;
}

std::optional<Scan> ScanAssembler::end_if_overdue(double time_us) {
  if (!open_) return std::nullopt;
  const std::int64_t places_left = end_of_scan() - newest_count_;
  const double due = newest_time_us_ + static_cast<double>(places_left) * kScanPeriodUs;
  if (time_us <= due + kOverdueUs) return std::nullopt;
  return close(end_of_scan());
}

std::optional<Scan> ScanAssembler::end() {
  if (!open_) return std::nullopt;
  return close(newest_count_ + 1);
}

Scan ScanAssembler::close(std::int64_t expected_end) {
  open_ = false;
  Scan scan;
  scan.sequence = sequence_++;
  scan.missing_packets = static_cast<std::int32_t>(expected_end - first_count_ - packets_);
  scan.utime = std::llround(points_.empty() ? first_time_us_ : points_.front().time_us);
  scan.points.reserve(points_.size());
  for (const TimedPoint& point : points_) {
    const auto dt_us = static_cast<std::int32_t>(std::llround(point.time_us) - scan.utime);
    scan.points.push_back({point.position, point.intensity, dt_us});
  }
  if (!scan.points.empty()) scan.duration_us = scan.points.back().dt_us;
  points_.clear();
  return scan;
}

std::int64_t ScanAssembler::scan_of(std::int64_t count) const {
  const std::int64_t quotient = count / packets_per_scan_;
  return count % packets_per_scan_ < 0 ? quotient - 1 : quotient;
}

}  // namespace ignis::l1
