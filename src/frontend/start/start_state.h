// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <Eigen/Core>

#include "common/pose.h"
#include "frontend/filter/eskf.h"
#include "frontend/frontend_config.h"

/// A motion that scans told of before the start (StartMotion), and the first state that it makes.
namespace ignis {

/// Turn rate [rad/s] and velocity [m/s] of a vehicle that keeps both, in body axes.
struct SteadyMotion {
  Vector6d twist = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Identity();

  /// False where it is too slow to be told from standing.
  [[nodiscard]] bool is_rolling() const;
};

/// Motion of a vehicle that keeps neither, at the newest instant, beside what the inertial unit says of it.
struct BentMotion {
  SteadyMotion steady;                                     ///< velocity then, and the turn rate that the gyro misses
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();  ///< [m/s^2] body axes, that a tilt of the start hides
  double acceleration_sigma = 0.0;                         ///< [m/s^2] per axis
};

/// A first state that was found as if at rest, for a vehicle that rolls: what the gyro read was turn and bias, and the
/// mean specific force held what turning at speed feels.
void set_rolling(FilterState& first, const SteadyMotion& motion, double gravity_m);

/// A vehicle in motion at the newest instant: `standing` has the attitude that the scans were asked with.
[[nodiscard]] FilterState moving_state(const FrontendConfig& config, const NavState& standing,
                                       const BentMotion& motion);

/// For people.
[[nodiscard]] std::string describe(const SteadyMotion& motion);
[[nodiscard]] std::string describe(const BentMotion& motion);

}  // namespace ignis
