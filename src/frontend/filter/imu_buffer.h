// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/byte_codec.h"
#include "common/leap_guard.h"
#include "common/measurement_bytes.h"
#include "common/measurements.h"

namespace ignis {

/// Why an IMU sample was not taken.
enum class ImuFault : std::int8_t { kNone, kNotFinite, kImplausible, kDuplicate, kLate, kLeap };

[[nodiscard]] const char* text(ImuFault fault);

/// How often each thing happened since the last reset.
struct ImuCounters {
  std::int64_t accepted = 0;
  std::int64_t not_finite = 0;
  std::int64_t implausible = 0;
  std::int64_t duplicate = 0;
  std::int64_t late = 0;
  std::int64_t gaps = 0;       ///< intervals longer than three nominal periods
  std::int64_t saturated = 0;  ///< accepted with the clip flag
  std::int64_t leaps = 0;      ///< stamps far ahead of the stream, put aside
  std::int64_t coasted = 0;    ///< made up where the IMU was silent
};

void transfer(auto& io, FieldsOf<ImuCounters> auto& counters) {
  io.number(counters.accepted);
  io.number(counters.not_finite);
  io.number(counters.implausible);
  io.number(counters.duplicate);
  io.number(counters.late);
  io.number(counters.gaps);
  io.number(counters.saturated);
  io.number(counters.leaps);
  io.number(counters.coasted);
}

/// The recent IMU samples in time order, and what is wrong with their stream. The nominal period is learned from the
/// data (running median), so 250 Hz, 100 Hz and 10 Hz streams need no configuration.
class ImuBuffer {
 public:
  /// Appends a sample, or says why not. Depends on earlier samples only.
  ///
  /// A stamp more than a second ahead of the stream is put aside: taken at its word, one corrupt stamp would make all
  /// later samples "late". Only when the next sample carries on from it was it a gap, and that one is taken. The very
  /// first sample gives way to one more than a second before it.
  ImuFault add(const ImuSample& sample);

  /// Appends a made-up sample where the IMU is silent. Its interval counts as a gap.
  void add_coasting(const ImuSample& sample);

  /// Forgets samples before `utime`, but keeps one at or before it.
  void forget_before(Utime utime);

  [[nodiscard]] bool empty() const { return samples_.empty(); }
  [[nodiscard]] const std::vector<ImuSample>& samples() const { return samples_; }
  [[nodiscard]] Utime newest() const { return samples_.back().utime; }
  /// Length of the interval that ends at sample i, in nominal periods; 1 for a healthy stream, 0 for the first sample.
  [[nodiscard]] double periods_before(std::size_t i) const { return periods_before_[i]; }
  /// True when the interval that ends at sample i is a gap.
  [[nodiscard]] bool gap_before(std::size_t i) const { return periods_before_[i] > kGapPeriods; }
  [[nodiscard]] const ImuCounters& counters() const { return counters_; }

 private:
  static constexpr double kGapPeriods = 3.0;
  static constexpr std::size_t kMedianLength = 31;

  [[nodiscard]] ImuFault judge(const ImuSample& sample);
  [[nodiscard]] double nominal_period_us() const;

  std::vector<ImuSample> samples_;
  std::vector<double> periods_before_;
  std::array<std::int64_t, kMedianLength> intervals_us_{};  ///< ring of the last intervals
  std::size_t interval_count_ = 0;
  LeapGuard leap_guard_;
  ImuCounters counters_;

  friend void transfer(auto& io, FieldsOf<ImuBuffer> auto& buffer) {
    io.list(buffer.samples_);
    io.list(buffer.periods_before_);
    for (auto& interval : buffer.intervals_us_) io.number(interval);
    io.number(buffer.interval_count_);
    transfer(io, buffer.leap_guard_);
    transfer(io, buffer.counters_);
  }
};

}  // namespace ignis
