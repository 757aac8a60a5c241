// SPDX-License-Identifier: Apache-2.0
#include "drivers/sensor_clock.h"

#include <algorithm>
#include <cmath>

#include "drivers/l1_messages.h"

namespace ignis::l1 {

namespace {

constexpr double kMaxBend = 0.02;
constexpr double kJumpUs = 20'000.0;
constexpr double kAuxiliaryLineTimeUs = 221 * kByteTimeUs;
/// 200 ms of both streams hold every phase of their beat twice.
constexpr double kAlignedAfterUs = 200'000.0;

}  // namespace

double SteadyStamps::stamp(std::int64_t count, double target_us) {
  if (!started_) {
    last_us_ = target_us;
  } else {
    const double nominal = static_cast<double>(count - last_count_) * period_us_;
    const double error = target_us - (last_us_ + nominal);
    if (std::abs(error) > kJumpUs) {
      last_us_ = std::max(target_us, last_us_ + 0.5 * nominal);
    } else {
      last_us_ += nominal + std::clamp(error, -kMaxBend * nominal, kMaxBend * nominal);
    }
  }
  started_ = true;
  last_count_ = count;
  return last_us_;
}

SensorClock::SensorClock(const DriverConfig& config)
    : by_arrival_(config.time_source == "arrival"),
      start_us_(config.start_time_s * 1e6),
      scan_latency_us_(config.scan_latency_ms * 1e3),
      imu_latency_us_(config.imu_latency_ms * 1e3),
      scan_line_(kScanPeriodUs, config.clock_window_s * 1e6, Bound::kUpper),
      imu_upper_(kImuPeriodUs, config.clock_window_s * 1e6, Bound::kUpper),
      imu_lower_(kImuPeriodUs, config.clock_window_s * 1e6, Bound::kLower),
      packet_stamps_(kScanPeriodUs),
      imu_stamps_(kImuPeriodUs) {}

void SensorClock::on_auxiliary(std::int64_t count, double sent_before_us) {
  if (by_arrival_) return scan_line_.add(count, sent_before_us - scan_latency_us_);
  last_auxiliary_us_ = nominal_packet_time(count) + scan_latency_us_;
  bound_imu_from_above(*last_auxiliary_us_);
}

void SensorClock::on_distance(std::int64_t count) {
  if (by_arrival_) return;
  bound_imu_from_above(nominal_packet_time(count) + scan_latency_us_ + kAuxiliaryLineTimeUs);
}

void SensorClock::on_imu(std::int64_t count, double sent_before_us) {
  if (by_arrival_) return imu_upper_.add(count, sent_before_us - imu_latency_us_);
  if (last_auxiliary_us_) imu_lower_.add(count, *last_auxiliary_us_ - imu_latency_us_);
  awaiting_upper_.push_back(count);
}

void SensorClock::bound_imu_from_above(double sent_us) {
  for (const std::int64_t count : awaiting_upper_) imu_upper_.add(count, sent_us - imu_latency_us_);
  awaiting_upper_.clear();
}

void SensorClock::restart() {
  for (ClockLine* line : {&scan_line_, &imu_upper_, &imu_lower_}) line->forget();
  last_auxiliary_us_.reset();
  awaiting_upper_.clear();
}

bool SensorClock::ready() const {
  return by_arrival_ || (imu_upper_.span_us() >= kAlignedAfterUs && imu_lower_.span_us() >= kAlignedAfterUs);
}

double SensorClock::packet_time(std::int64_t count) {
  if (!by_arrival_) return nominal_packet_time(count);
  return packet_stamps_.stamp(count, scan_line_.at(count));
}

double SensorClock::imu_time(std::int64_t count) {
  double target = start_us_ + static_cast<double>(count) * kImuPeriodUs;
  if (by_arrival_) {
    target = imu_upper_.at(count);
  } else if (!imu_upper_.empty() && !imu_lower_.empty()) {
    target = 0.5 * (imu_upper_.at(count) + imu_lower_.at(count));
  }
  return imu_stamps_.stamp(count, target);
}

std::int64_t SensorClock::restarts() const {
  return scan_line_.restarts() + imu_upper_.restarts() + imu_lower_.restarts();
}

double SensorClock::offset_us() const { return by_arrival_ ? scan_line_.at(0) : start_us_; }
double SensorClock::drift_ppm() const { return scan_line_.drift_ppm(); }
double SensorClock::jitter_us() const { return scan_line_.jitter_us(); }

double SensorClock::nominal_packet_time(std::int64_t count) const {
  return start_us_ + static_cast<double>(count) * kScanPeriodUs;
}

}  // namespace ignis::l1
