// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/measurements.h"
#include "common/nav_state.h"

namespace ignis {

/// A speed that the front end has measured by a wall which is in no map, along a direction that scans do not observe.
struct SightedSpeed {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit
  double speed = 0.0;                               ///< [m/s] of the body along it
  double variance = 0.0;                            ///< [m^2/s^2]
};

/// What the front end hands to the back end and the map every few metres.
struct Keyframe {
  std::int32_t id = 0;                           ///< 0, 1, 2 ... never reused within a session
  std::int32_t session = 0;                      ///< +1 whenever the front end begins anew
  NavState state;                                ///< at the keyframe's instant, frame odom
  Matrix15d covariance = Matrix15d::Identity();  ///< order of ErrorBlock
  /// Information that scan matching and standing still, without the IMU (posterior minus prediction), hold on the pose
  /// relative to the previous keyframe; attitude then position, both in body axes of this keyframe. Zero when no scan
  /// was applied and the vehicle did not stand.
  Matrix6d scan_information = Matrix6d::Zero();
  std::optional<SightedSpeed> sighted;  ///< at the keyframe's instant, in its body axes
  Utime previous_utime = 0;             ///< [us] instant of the previous keyframe; equals state.utime for the first
  bool stationary = false;              ///< stood still during the whole interval
  bool imu_complete = true;             ///< false when the interval has an IMU gap
  std::vector<ImuSample> imu;           ///< all samples with previous_utime <= utime < state.utime
  std::vector<CloudPoint> cloud;        ///< body frame of the keyframe, downsampled, about one second of scans
};

}  // namespace ignis
