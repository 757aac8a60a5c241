// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/gtsam_conversion.h"

#include <gtsam/geometry/Pose2.h>
#include <gtsam/geometry/Pose3.h>
#include <gtsam/navigation/ImuBias.h>

#include <cmath>

namespace ignis {

gtsam::Pose3 to_gtsam(const Pose& pose) { return {gtsam::Rot3(pose.rotation.normalized()), pose.translation}; }

Pose from_gtsam(const gtsam::Pose3& pose) { return {pose.rotation().toQuaternion().normalized(), pose.translation()}; }

gtsam::Pose2 to_planar_gtsam(const Pose& pose) {
  return {pose.translation.x(), pose.translation.y(), 2.0 * std::atan2(pose.rotation.z(), pose.rotation.w())};
}

Pose from_gtsam(const gtsam::Pose2& pose) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(pose.theta(), Eigen::Vector3d::UnitZ())), {pose.x(), pose.y(), 0.0}};
}

gtsam::imuBias::ConstantBias bias_of(const NavState& state) { return {state.accel_bias, state.gyro_bias}; }

}  // namespace ignis
