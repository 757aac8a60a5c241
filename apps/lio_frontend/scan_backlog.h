// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/measurements.h"
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

  /// Whether to leave out a scan behind which `waiting` others wait; once for each scan, in their order. Of the scan
  /// only its stamps matter.
  [[nodiscard]] bool leaves_out(const Scan& scan, double waiting) {
    const double waiting_s = waiting * period_s(scan);
    if (is_near_ && waiting_s > most_s_) {
      is_behind_ = true;
      is_near_ = false;
      waited_ = waiting;
      catching_up_ = kLongestCatchUp * static_cast<std::int64_t>(waiting);
      last_left_out_ = scan.end_utime();
    }
    last_left_out_ = std::min(last_left_out_, scan.end_utime());  // the sensor's clock may be set back
    if (scan.end_utime() - last_left_out_ > kCalm) is_behind_ = false;
    is_near_ = is_near_ || waiting_s <= kFew_s;
    if (!is_behind_ || waiting_s <= kFew_s) return false;
    if (catching_up_ > 0 && --catching_up_ % kKeptOf == 0 && waiting <= waited_) return false;
    last_left_out_ = scan.end_utime();
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
  static constexpr double kPeriodOfInstants_s = 0.1;  // of scans whose points are all of one instant

  /// From one scan to the next: scans of one sensor follow one another.
  static double period_s(const Scan& scan) {
    return scan.duration_us > 0 ? 1e-6 * static_cast<double>(scan.duration_us) : kPeriodOfInstants_s;
  }

  double most_s_;
  Utime last_left_out_ = 0;
  double waited_ = 0.0;           // scans, when the computer fell behind
  std::int64_t catching_up_ = 0;  // scans to go, of which every fifth is kept
  std::int64_t left_out_ = 0;
  bool is_behind_ = false;
  bool is_near_ = true;  // few have waited since the computer fell behind last
};

}  // namespace ignis
