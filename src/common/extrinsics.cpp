// SPDX-License-Identifier: Apache-2.0
#include "common/extrinsics.h"

#include <numbers>

#include "common/frames.h"

namespace ignis {

Pose Mount::T_body_sensor() const {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const Eigen::Quaterniond q_body_level =
      axes == "forward_left_up" ? frames::q_body_from_forward_left_up() : Eigen::Quaterniond::Identity();
  const Eigen::Quaterniond q_turn =
      frames::from_yaw_pitch_roll({yaw_deg * kDegree, pitch_deg * kDegree, roll_deg * kDegree});
  return {(q_turn * q_body_level).normalized(), {translation_m[0], translation_m[1], translation_m[2]}};
}

}  // namespace ignis
