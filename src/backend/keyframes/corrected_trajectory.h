// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "common/trajectory_file.h"

namespace ignis {

/// A keyframe as odometry saw it and as the graph places it.
struct KeyframeCorrection {
  Utime utime = 0;  ///< [us]
  Pose T_odom_body;
  Pose T_map_body;

  /// What takes odom to map at this keyframe.
  [[nodiscard]] Pose T_map_odom() const { return T_map_body * T_odom_body.inverse(); }
};

/// Places every pose of an odometry trajectory in map: between two keyframes the correction is interpolated in time,
/// before the first and behind the last the nearest one holds. `keyframes` ascend in utime; without any, the result is
/// the odometry itself. (python/ignis/results.py applies the same rule to live runs.)
[[nodiscard]] Trajectory corrected_trajectory(const Trajectory& odometry,
                                              const std::vector<KeyframeCorrection>& keyframes);

}  // namespace ignis
