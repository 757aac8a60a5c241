// SPDX-License-Identifier: Apache-2.0
#pragma once

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
};

/// Blocks of the 15-dimensional error state: attitude (right perturbation, body axes), position and velocity (odom
/// axes), gyro bias, accelerometer bias. Every 15x15 covariance in the project has this order.
enum ErrorBlock : int { kAttitude = 0, kPosition = 3, kVelocity = 6, kGyroBias = 9, kAccelBias = 12 };

}  // namespace ignis
