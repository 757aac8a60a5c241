// SPDX-License-Identifier: Apache-2.0
#include "common/frames.h"

#include <algorithm>
#include <cmath>

namespace ignis::frames {

YawPitchRoll to_yaw_pitch_roll(const Eigen::Quaterniond& q_world_body) {
  // R = Ry(yaw) Rx(pitch) Rz(-roll): forward is -Z, so "right side down" is a negative turn about +Z.
  const Eigen::Matrix3d R = q_world_body.toRotationMatrix();
  YawPitchRoll attitude;
  attitude.pitch = std::asin(std::clamp(-R(1, 2), -1.0, 1.0));
  attitude.yaw = std::atan2(R(0, 2), R(2, 2));
  attitude.roll = -std::atan2(R(1, 0), R(1, 1));
  return attitude;
}

Eigen::Quaterniond from_yaw_pitch_roll(const YawPitchRoll& attitude) {
  return Eigen::AngleAxisd(attitude.yaw, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(attitude.pitch, Eigen::Vector3d::UnitX()) *
         Eigen::AngleAxisd(-attitude.roll, Eigen::Vector3d::UnitZ());
}

Eigen::Quaterniond q_body_from_forward_left_up() {
  Eigen::Matrix3d R;
  R << 0.0, -1.0, 0.0,  //
      0.0, 0.0, 1.0,    //
      -1.0, 0.0, 0.0;
  return Eigen::Quaterniond(R);
}

Eigen::Vector3d right_up_forward(const Eigen::Quaterniond& q_world_body, const Eigen::Vector3d& v_world) {
  const Eigen::Vector3d v_body = q_world_body.conjugate() * v_world;
  return {v_body.x(), v_body.y(), -v_body.z()};
}

}  // namespace ignis::frames
