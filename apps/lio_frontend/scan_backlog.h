// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/time.h"

namespace ignis {

/// Which scans a computer leaves out that is slower than its LiDAR. After a hiccup some seconds of them may wait, and
/// all are handled. When more wait, the oldest go, all but every fifth, which hold the pose on the way to the newest.
/// From then on few may wait, so that the pose is of now and scans are left out one by one, until for some seconds none
/// had to be.
class ScanBacklog {
 public:
  /// `most_s`: how much may wait [s] before the computer counts as behind.
  explicit ScanBacklog(double most_s) : most_s_(most_s) {}

  /// Whether to leave out the scan that ends at `end` [us], with `waiting` scans behind it.
  [[nodiscard]] bool leaves_out(Utime end, double waiting) {
    note_period(end);
    const double waiting_s = waiting * period_s_;
    if (!is_behind_ && waiting_s > most_s_) {
      is_behind_ = true;
      waited_ = waiting;
      catching_up_ = kLongestCatchUp * static_cast<std::int64_t>(waiting);
      last_left_out_ = end;
    }
    last_left_out_ = std::min(last_left_out_, end);  // the sensor's clock may be set back
    if (is_behind_ && end - last_left_out_ > kCalm) is_behind_ = false;
    if (waiting_s <= kFew_s) catching_up_ = 0;
    if (!is_behind_ || waiting_s <= kFew_s) return false;
    if (catching_up_ > 0 && --catching_up_ % kKeptOf == 0 && waiting <= waited_) return false;
    last_left_out_ = end;
    ++left_out_;
    return true;
  }

  /// More scans come than are handled; told until some seconds after the last one that was left out.
  [[nodiscard]] bool is_behind() const { return is_behind_; }
  [[nodiscard]] std::int64_t left_out() const { return left_out_; }

 private:
  static constexpr double kFew_s = 0.3;
  static constexpr std::int64_t kKeptOf = 5;
  static constexpr std::int64_t kLongestCatchUp = 4;  // times what waited; by then every fifth is too much as well
  static constexpr Utime kCalm = 10 * kMicrosPerSecond;
  static constexpr Utime kLongestPeriod = 200'000;  // [us] what is longer is a gap, or another clock

  void note_period(Utime end) {
    const Utime period = end - previous_end_;
    if (previous_end_ != 0 && period > 0 && period <= kLongestPeriod) period_s_ = 1e-6 * static_cast<double>(period);
    previous_end_ = end;
  }

  double most_s_;
  double period_s_ = 0.1;
  Utime previous_end_ = 0;
  Utime last_left_out_ = 0;
  double waited_ = 0.0;           // scans, when the computer fell behind
  std::int64_t catching_up_ = 0;  // scans to go, of which every fifth is kept
  std::int64_t left_out_ = 0;
  bool is_behind_ = false;
};

}  // namespace ignis
