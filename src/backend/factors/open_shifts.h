// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "backend/factors/preintegration.h"
#include "common/nav_state.h"

/// Shifts that the scans between two keyframes leave open, as the axis of a bare corridor, and whom the graph follows
/// there.
///
/// Nothing but the IMU holds the graph there. The filter has also used what weak structure there was, in each scan,
/// which is worth a correction but no claim to know. So the increments are moved such that the factor agrees with the
/// filter's motion along open shifts, and the covariance stays that of the samples alone: the filter's mean, the IMU's
/// doubt.
namespace ignis {

/// How open each direction is, symmetric, eigenvalues 0 (held by scans) to 1 (open). `position_information` is what
/// scans say of the position [1/m^2], in any axes; the result is in the same. Where they say nothing at all, nothing is
/// open: the filter had the same samples and no more.
[[nodiscard]] Eigen::Matrix3d open_shifts(const Eigen::Matrix3d& position_information);

/// Moves position and velocity increments along `open` (body axes at `from`) such that the sum carries `from`, with its
/// biases, to where `to` is. Fields named odom are in map, whose gravity is (0, -gravity, 0) [m/s^2].
[[nodiscard]] ImuSum agreeing_along(const Eigen::Matrix3d& open, const NavState& from, const NavState& to,
                                    double gravity, ImuSum sum);

}  // namespace ignis
