// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/shared_ptr.hpp>
#include <cstdint>

#include "common/nav_state.h"

namespace gtsam {
class NonlinearFactor;
}

namespace ignis {

/// What a start at rest knows of tilt and accelerometer bias: their sum. The first attitude was made such that what the
/// accelerometer read, less the bias that was assumed, points up; a bias b that nobody knows hides there as a tilt of
/// b / g. Two independent priors would say more than anybody knows, for each seems to confirm the other: the tilt's
/// sigma fell from 8.7 to 5.3 mrad within five seconds at rest, and its error stayed at 7.
///
/// Error: the specific force that a vehicle at rest would read with pose and bias, less the same at the start, across
/// the start's own vertical [m/s^2, body axes]. `start`: first pose (map, +Y up) and accelerometer bias; `sigma` of the
/// start's mean reading [m/s^2] per axis.
[[nodiscard]] boost::shared_ptr<gtsam::NonlinearFactor> make_start_tilt_factor(std::uint64_t pose_key,
                                                                               std::uint64_t bias_key,
                                                                               const NavState& start, double gravity,
                                                                               double sigma);

}  // namespace ignis
