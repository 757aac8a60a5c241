// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/imu_buffer.h"

#include <algorithm>
#include <cmath>

namespace ignis {
namespace {

// Beyond what any MEMS unit reports: such values are garbage on the wire (1e24 has been seen), not motion.
constexpr double kMaxRate = 200.0;          // rad/s
constexpr double kMaxAccel = 2000.0;        // m/s^2
constexpr double kCoastingPeriods = 400.0;  // as uncertain as a gap of this length: twenty times the sigma

}  // namespace

const char* text(ImuFault fault) {
  switch (fault) {
    case ImuFault::kNone:
      return "accepted";
    case ImuFault::kNotFinite:
      return "not finite";
    case ImuFault::kImplausible:
      return "implausible value";
    case ImuFault::kDuplicate:
      return "duplicate stamp";
    case ImuFault::kLate:
      return "older than the newest sample";
    case ImuFault::kLeap:
      return "stamp far ahead of the stream";
  }
  return "unknown fault";
}

ImuFault ImuBuffer::judge(const ImuSample& sample) {
  if (!sample.gyro.allFinite() || !sample.accel.allFinite()) {
    ++counters_.not_finite;
    return ImuFault::kNotFinite;
  }
  if (sample.gyro.cwiseAbs().maxCoeff() > kMaxRate || sample.accel.cwiseAbs().maxCoeff() > kMaxAccel) {
    ++counters_.implausible;
    return ImuFault::kImplausible;
  }
  if (!samples_.empty() && sample.utime == newest()) {
    ++counters_.duplicate;
    return ImuFault::kDuplicate;
  }
  if (!samples_.empty() && sample.utime < newest()) {
    ++counters_.late;
    return ImuFault::kLate;
  }
  if (!samples_.empty() && leap_guard_.leaps_ahead(newest(), sample.utime)) {
    ++counters_.leaps;
    return ImuFault::kLeap;
  }
  return ImuFault::kNone;
}

ImuFault ImuBuffer::add(const ImuSample& sample) {
  const ImuFault fault = judge(sample);
  // A first sample that nothing has confirmed must not shut out all that follow: its stamp was the broken one.
  const bool begins_anew =
      fault == ImuFault::kLate && samples_.size() == 1 && newest() - sample.utime > kMicrosPerSecond;
  if (begins_anew) {
    samples_.clear();
    periods_before_.clear();
  }
  if (fault != ImuFault::kNone && !begins_anew) return fault;
  double periods = 0.0;
  if (!samples_.empty()) {
    const std::int64_t interval = sample.utime - newest();
    periods = interval_count_ == 0 ? 1.0 : static_cast<double>(interval) / nominal_period_us();
    intervals_us_[interval_count_ % kMedianLength] = interval;
    ++interval_count_;
  }
  samples_.push_back(sample);
  periods_before_.push_back(periods);
  ++counters_.accepted;
  if (periods > kGapPeriods) ++counters_.gaps;
  if (sample.saturated) ++counters_.saturated;
  return ImuFault::kNone;
}

void ImuBuffer::add_coasting(const ImuSample& sample) {
  samples_.push_back(sample);
  periods_before_.push_back(kCoastingPeriods);
  ++counters_.coasted;
}

double ImuBuffer::nominal_period_us() const {
  std::array<std::int64_t, kMedianLength> sorted = intervals_us_;
  const std::size_t count = std::min(interval_count_, kMedianLength);
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(count));
  return static_cast<double>(*middle);
}

void ImuBuffer::forget_before(Utime utime) {
  const auto first_after = std::ranges::upper_bound(samples_, utime, {}, &ImuSample::utime);
  const auto count = first_after - samples_.begin() - 1;
  // Erasing from the front of a vector moves the rest: do it rarely.
  if (count < 256) return;
  samples_.erase(samples_.begin(), samples_.begin() + count);
  periods_before_.erase(periods_before_.begin(), periods_before_.begin() + count);
}

}  // namespace ignis
