// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "common/pose.h"

namespace ignis {

/// A keyframe as the graph places it.
struct KeyframePose {
  std::int32_t id = 0;
  Pose T_map_body;  ///< [m]
};

}  // namespace ignis
