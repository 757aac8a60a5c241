// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/nav_state.h"

namespace gtsam {
class Pose2;
class Pose3;
namespace imuBias {
class ConstantBias;
}
}  // namespace gtsam

/// Between our structs and GTSAM's. Both order a pose's tangent space rotation first, in body axes; GTSAM orders a bias
/// accelerometer first.
namespace ignis {

[[nodiscard]] gtsam::Pose3 to_gtsam(const Pose& pose);
[[nodiscard]] Pose from_gtsam(const gtsam::Pose3& pose);
/// x, y and heading of a pose in the plane.
[[nodiscard]] gtsam::Pose2 to_planar_gtsam(const Pose& pose);
[[nodiscard]] Pose from_gtsam(const gtsam::Pose2& pose);
[[nodiscard]] gtsam::imuBias::ConstantBias bias_of(const NavState& state);

}  // namespace ignis
