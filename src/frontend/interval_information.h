// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "frontend/eskf.h"

namespace ignis {

/// What scan matching alone holds on the pose of the newest scan relative to where the interval began.
///
/// Two covariances are carried side by side from a pose that is taken as exact, with velocity and biases as uncertain
/// as the filter says: one sees the scans, one does not. The difference of their pose informations is what the scans
/// have added, over the whole interval: a direction that every scan sees badly is known far better after a hundred of
/// them, and one that was seen at the end alone is known as well as one that was seen all the time. Where no scan says
/// anything the difference is zero, so that the inertial unit is not counted twice.
class IntervalInformation {
 public:
  explicit IntervalInformation(const FrontendConfig& config) : config_(config) {}

  /// A new interval begins at this state.
  void begin(const FilterState& filter);

  void add_imu(const ImuSample& sample);

  /// A scan at `state`, with the information that it had on its pose: attitude then position, body axes; zero when it
  /// was not applied.
  void add_scan(const NavState& state, const Matrix6d& information_body);

  /// Attitude then position, body axes of the newest scan. Positive semidefinite; zero before the first scan.
  [[nodiscard]] Matrix6d information() const;

 private:
  [[nodiscard]] InertialInput mean_input() const;

  FrontendConfig config_;
  NavState state_;  ///< at the newest scan
  ErrorCovariance with_scans_ = ErrorCovariance::Zero();
  ErrorCovariance without_scans_ = ErrorCovariance::Zero();
  InertialInput sum_;  ///< of the samples since the newest scan
  int samples_ = 0;
  bool informed_ = false;  ///< a scan has said something

  friend void transfer(auto& io, FieldsOf<IntervalInformation> auto& interval) {
    transfer(io, interval.state_);
    io.matrix(interval.with_scans_);
    io.matrix(interval.without_scans_);
    io.matrix(interval.sum_.gyro);
    io.matrix(interval.sum_.accel);
    io.number(interval.samples_);
    io.number(interval.informed_);
  }
};

}  // namespace ignis
