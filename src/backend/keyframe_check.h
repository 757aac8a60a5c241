// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "common/keyframe.h"

namespace ignis {

/// Why a keyframe must not enter the graph whatever else holds: pose, velocity, biases or information not finite, a
/// quaternion that is not of unit length, an information matrix that is not symmetric. Empty when it may. IMU samples
/// and cloud points are not judged here: the keyframe can do without them.
[[nodiscard]] std::string keyframe_problem(const Keyframe& keyframe);

}  // namespace ignis
