// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/pose.h"

/// Axis conventions. Body and world: +X right, +Y up, -Z forward; gravity is (0, -g, 0) in the world.
namespace ignis::frames {

/// Attitude for people [rad]: yaw positive to the left, pitch positive nose up, roll positive right side down.
/// The body is first turned by yaw about up, then by pitch about its right axis, then by roll about its forward axis.
struct YawPitchRoll {
  double yaw = 0.0;
  double pitch = 0.0;
  double roll = 0.0;
};

[[nodiscard]] YawPitchRoll to_yaw_pitch_roll(const Eigen::Quaterniond& q_world_body);
[[nodiscard]] Eigen::Quaterniond from_yaw_pitch_roll(const YawPitchRoll& attitude);

/// Rotation that takes ROS axes (X forward, Y left, Z up; REP-103) to ours: (x, y, z)_ours = (-y, z, -x)_ros.
[[nodiscard]] Eigen::Quaterniond q_body_from_forward_left_up();

/// Unit vector "up" of the world, in world coordinates.
[[nodiscard]] inline Eigen::Vector3d up() { return Eigen::Vector3d::UnitY(); }

/// Body axes into velocities that people read [m/s]: right, up, forward.
[[nodiscard]] Eigen::Vector3d right_up_forward(const Eigen::Quaterniond& q_world_body, const Eigen::Vector3d& v_world);

}  // namespace ignis::frames
