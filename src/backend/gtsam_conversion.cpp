// SPDX-License-Identifier: Apache-2.0
#include "backend/gtsam_conversion.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/navigation/ImuBias.h>

namespace ignis {

gtsam::Pose3 to_gtsam(const Pose& pose) { return {gtsam::Rot3(pose.rotation.normalized()), pose.translation}; }

Pose from_gtsam(const gtsam::Pose3& pose) { return {pose.rotation().toQuaternion().normalized(), pose.translation()}; }

gtsam::imuBias::ConstantBias bias_of(const NavState& state) { return {state.accel_bias, state.gyro_bias}; }

}  // namespace ignis
