// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "frontend/eskf.h"

namespace ignis {

/// What a turn reveals of the tilt that the start had.
///
/// At rest an accelerometer bias b cannot be told from a tilt b / g. The first attitude is level by definition (see
/// Lio), so the tilt stays with the frame of the map, the bias turns with the vehicle, and what cancels at the heading
/// of the start is off by 2 b after half a turn. A state for the direction of gravity would follow that; fifteen have
/// none. So the accelerometer bias of the published covariance takes a random walk over heading: `accel_bias_sigma`^2
/// [(m/s^2)^2] per radian.
void widen_by_turn(Matrix15d& covariance, const NavState& state, const InertialInput& input, double dt,
                   double accel_bias_sigma);

}  // namespace ignis
