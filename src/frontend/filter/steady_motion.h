// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "frontend/filter/eskf.h"

/// What is assumed of a vehicle of which nothing is heard: it keeps its speed, in body axes, and its turn rate.
namespace ignis {

/// The input under which predict_nominal keeps turn rate and velocity in odom as they are; biased, as measured.
[[nodiscard]] InertialInput steady_input(const NavState& state, double gravity);

/// Nominal and covariance over `seconds` in which neither stream said anything. With T the turn of that time and
/// u = R^T v the velocity in body axes,
///   R' = R T,   v' = R T u,   p' = p + (v + v') seconds / 2.
/// What a vehicle may do beside is a constant unknown turn rate (sigma 0.1 rad/s per axis) and acceleration (sigma
/// 1 m/s^2). Biases and gravity stay.
void go_on_steadily(FilterState& filter, double seconds);

}  // namespace ignis
