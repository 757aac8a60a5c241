// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/pose.h"

/// Fixed arrays of LCM messages to Eigen and back. Quaternions are stored w x y z.
namespace ignis::messages {

inline void store(const Eigen::Vector3d& from, double (&to)[3]) {
  for (int i = 0; i < 3; ++i) to[i] = from[i];
}

inline void store(const Eigen::Quaterniond& from, double (&to)[4]) {
  to[0] = from.w();
  to[1] = from.x();
  to[2] = from.y();
  to[3] = from.z();
}

[[nodiscard]] inline Eigen::Vector3d load(const double (&from)[3]) { return {from[0], from[1], from[2]}; }

[[nodiscard]] inline Eigen::Quaterniond load(const double (&from)[4]) { return {from[0], from[1], from[2], from[3]}; }

}  // namespace ignis::messages
