// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/pose.h"
#include "common/time.h"

namespace ignis {

/// The nominal state of the filter at one instant, in frame odom.
struct NavState {
  Utime utime = 0;                                         ///< [us]
  Pose T_odom_body;                                        ///< [m]
  Eigen::Vector3d v_odom = Eigen::Vector3d::Zero();        ///< [m/s] of the body origin, odom axes
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();     ///< [rad/s] body axes
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();    ///< [m/s^2] body axes
  Eigen::Vector3d angular_rate = Eigen::Vector3d::Zero();  ///< [rad/s] body axes, bias removed
  Eigen::Vector2d gravity_tilt = Eigen::Vector2d::Zero();  ///< x and z of the unit vector along gravity, odom axes

  /// Unit vector along gravity, odom axes: straight down, -Y, as far as frame odom began level. It never comes up to
  /// the horizon, whatever the tilt.
  [[nodiscard]] Eigen::Vector3d gravity_direction() const {
    return {gravity_tilt.x(), -std::sqrt(std::max(1.0 - gravity_tilt.squaredNorm(), 0.01)), gravity_tilt.y()};
  }
};

/// Blocks of the error state: attitude (right perturbation, body axes), position and velocity (odom axes), gyro bias,
/// accelerometer bias, tilt of gravity in odom. What is published ends before the last block: every 15x15 covariance in
/// the project has this order.
enum ErrorBlock : int {
  kAttitude = 0,
  kPosition = 3,
  kVelocity = 6,
  kGyroBias = 9,
  kAccelBias = 12,
  kGravityTilt = 15,
  kErrorSize = 17
};

}  // namespace ignis
