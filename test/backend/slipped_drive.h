// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "backend/synthetic_drive.h"

namespace ignis::testing {

/// A lap in a hall, a way on which neither scans nor IMU tell how far it leads, and a lap in a hall that looks the
/// same: another one, or the first again.
struct SlipOptions {
  unsigned seed = 1;
  double speed = 1.0;      ///< [m/s]
  double turn_rate = 0.4;  ///< [rad/s]; with the speed, the radius of the laps
  int keyframes = 14;      ///< of each lap
  int blind_keyframes = 8;
  Eigen::Vector3d second_hall = Eigen::Vector3d::Zero();  ///< [m] from the first one; zero: the same hall
  Eigen::Vector3d slip = Eigen::Vector3d::Zero();         ///< [m] error of odometry over the blind way
};

/// Keyframes with clouds. The blind ones have no IMU and no scan information.
[[nodiscard]] Drive make_slipped_drive(const SlipOptions& options);

}  // namespace ignis::testing
