// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "common/keyframe.h"
#include "common/pose.h"

namespace ignis::testing {

/// A vehicle that drives circles to the left at constant speed in a hall with walls, pillars and a floor. On a circle
/// gyro and specific force are constant in the body, so holding a sample until the next one is exact.
struct DriveOptions {
  unsigned seed = 1;
  int keyframes = 45;       ///< a lap has 21
  double speed = 2.0;       ///< [m/s]
  double turn_rate = 0.2;   ///< [rad/s] to the left
  double interval_s = 1.5;  ///< between keyframes
  double imu_rate_hz = 100.0;
  double gyro_noise = 0.003;       ///< [rad/s/sqrt(Hz)]
  double accel_noise = 0.06;       ///< [m/s^2/sqrt(Hz)]
  double odometry_sigma_m = 0.02;  ///< of each relative pose, per axis
  double odometry_sigma_rad = 0.005;
  int cloud_points = 0;  ///< per keyframe; 0: no clouds
};

struct Drive {
  std::vector<Keyframe> keyframes;  ///< with drifting odometry
  std::vector<Pose> T_world_body;   ///< truth; the first equals the first keyframe's odometry
};

[[nodiscard]] Drive make_drive(const DriveOptions& options);

/// A vehicle that stands still, level, for `count` keyframes 1 s apart, without scans.
[[nodiscard]] std::vector<Keyframe> make_rest(int count, unsigned seed);

/// Root mean square distance of positions [m], without alignment.
[[nodiscard]] double position_error(const std::vector<Pose>& estimate, const std::vector<Pose>& truth);

/// Points on the surfaces of the hall as seen from a true pose, in its body frame, within 15 m, 1 cm noise.
[[nodiscard]] std::vector<CloudPoint> hall_cloud(const Pose& T_world_body, int points, unsigned seed);

}  // namespace ignis::testing
