// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace ignis::sim {

/// Angular rate [rad/s] and specific force [m/s^2] in the axes of the inertial unit.
struct ImuReading {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();

  ImuReading& operator+=(const ImuReading& other) {
    gyro += other.gyro;
    accel += other.accel;
    return *this;
  }
};

}  // namespace ignis::sim
