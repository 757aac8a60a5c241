// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "frontend/filter/eskf.h"
#include "frontend/filter/regained_view.h"
#include "frontend/filter/standstill.h"

namespace ignis {

/// What scan matching and standing still, without the inertial unit, hold on the pose of the newest scan relative to
/// where the interval began.
///
/// Two covariances are carried side by side from a pose that is taken as exact, with velocity and biases as uncertain
/// as the filter says: one sees the scans, one does not. The difference of their pose informations is what the scans
/// have added, over the whole interval: a direction that every scan sees badly is known far better after a hundred of
/// them. Where no scan says anything the difference is zero, so that the inertial unit is not counted twice.
///
/// Along a blind direction what little scans say is about planes that were mapped a moment ago, at poses that nothing
/// held: it measures the motion, and so the way from scan to scan, but takes nothing back of the way up to there. The
/// same holds once the direction is seen again: what comes into view was mapped on the way (RegainedView). So what a
/// scan takes from the position's covariance along such a direction is kept as a shift of the map.
class IntervalInformation {
 public:
  explicit IntervalInformation(const FrontendConfig& config) : config_(config) {}

  /// A new interval begins at this state.
  void begin(const FilterState& filter);

  void add_imu(const ImuSample& sample);

  /// A scan at `state`, with the information that it had on its pose: attitude then position, body axes; zero when it
  /// was not applied. It did not observe shifts along the unit axes `blind` (odom).
  void add_scan(const NavState& state, const Matrix6d& information_body, std::span<const Eigen::Vector3d> blind);

  /// The vehicle stood, as the filter has taken it at the scan that comes next; counted at the newest one, a scan
  /// earlier. The graph cannot tell: along what scans leave open it makes decimetres of five seconds of accelerometer
  /// noise.
  void add_standstill(const Standstill& standstill);

  /// Attitude then position, body axes of the newest scan. Positive semidefinite; zero before the first scan or
  /// standstill.
  [[nodiscard]] Matrix6d information() const;

 private:
  void take(const Matrix6d& information_body, std::span<const Eigen::Vector3d> blind);
  [[nodiscard]] InertialInput mean_input() const;
  [[nodiscard]] Eigen::Matrix3d position_in_map() const;

  FrontendConfig config_;
  NavState state_;  ///< at the newest scan
  ErrorCovariance with_scans_ = ErrorCovariance::Zero();
  ErrorCovariance without_scans_ = ErrorCovariance::Zero();
  RegainedView view_;                                    ///< since the newest scan
  Eigen::Matrix3d map_shift_ = Eigen::Matrix3d::Zero();  ///< [m^2, odom axes] of what scans meet, since the beginning
  InertialInput sum_;                                    ///< of the samples since the newest scan
  int samples_ = 0;
  bool informed_ = false;  ///< a scan or a standstill has said something

  friend void transfer(auto& io, FieldsOf<IntervalInformation> auto& interval) {
    transfer(io, interval.state_);
    io.matrix(interval.with_scans_);
    io.matrix(interval.without_scans_);
    transfer(io, interval.view_);
    io.matrix(interval.map_shift_);
    io.matrix(interval.sum_.gyro);
    io.matrix(interval.sum_.accel);
    io.number(interval.samples_);
    io.number(interval.informed_);
  }
};

}  // namespace ignis
