// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "common/keyframe.h"

namespace ignis {

/// Why a keyframe must not enter the graph whatever else holds: an id that none can follow, pose, velocity, biases,
/// covariance or information not finite or beyond anything that drives, a quaternion that is not of unit length, an
/// information matrix that is not symmetric. Empty when it may. IMU samples and cloud points are not judged here: the
/// keyframe can do without them.
[[nodiscard]] std::string keyframe_problem(const Keyframe& keyframe);

/// Why the keyframe cannot be where it says, given the pose of an earlier one at `utime` in the same frame odom: stamps
/// that do not ascend, or a way faster than any vehicle's. Empty when it can. Leaps of hundreds of kilometres leave the
/// solver without a digit for attitudes.
[[nodiscard]] std::string succession_problem(const Keyframe& keyframe, Utime utime, const Pose& T_odom_body);

}  // namespace ignis
