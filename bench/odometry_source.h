// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "common/keyframe.h"

/// What the factor between two keyframes could hold instead of what scan matching alone says, for comparison.
namespace ignis::bench {

/// The filter's posterior: the growth of its pose covariance from one keyframe to the next. It holds the IMU of the
/// interval, which the graph then counts twice.
void link_by_filter(std::vector<Keyframe>& keyframes);

/// Nothing: the IMU alone links two keyframes.
void link_by_nothing(std::vector<Keyframe>& keyframes);

}  // namespace ignis::bench
