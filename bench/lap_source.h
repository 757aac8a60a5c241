// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

#include "common/measurements.h"
#include "common/pose.h"
#include "replay_input.h"

namespace ignis::bench {

/// A sensor that never ends: the laps of a recorded drive, played again and again with stamps that go on. The log needs
/// GROUND_TRUTH, and a way that comes by a place of its first seconds once more near its end, on the same course.
class LapSource {
 public:
  /// Throws runtime::UserError when the log cannot be read, has no GROUND_TRUTH, or the drive never comes back.
  explicit LapSource(const std::filesystem::path& log);

  /// Calls the handlers with every measurement, in time order, until `seconds` of the sensor's time have gone by or
  /// `proceed` returns false.
  void run(double seconds, const std::function<void(const ImuSample&)>& on_imu,
           const std::function<void(Scan)>& on_scan, const std::function<bool()>& proceed) const;

  /// Where the body was at an instant of the endless drive, frame of the recording.
  [[nodiscard]] Pose truth_at(Utime utime) const;

  [[nodiscard]] double lap_s() const { return seconds_between(begin_, end_); }

 private:
  ReplayInput input_;
  Utime first_ = 0;
  Utime begin_ = 0;  // of what is repeated
  Utime end_ = 0;
};

}  // namespace ignis::bench
