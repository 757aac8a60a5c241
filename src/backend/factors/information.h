// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "common/pose.h"

/// Information matrices of relative poses (attitude then position, body axes of the later pose), some of whose
/// directions may hold nothing at all.
namespace ignis {

/// Rows W with W^T W equal to an information matrix; as many rows as there are informed directions.
using WhiteningRows = Eigen::Matrix<double, Eigen::Dynamic, 6>;

/// Square root of a symmetric positive semi-definite matrix. Directions that hold less than 1e-12 of the strongest one
/// (also negative ones, left over from a subtraction) are dropped.
[[nodiscard]] WhiteningRows whitening(const Matrix6d& information);

/// Square root of (information^-1 + floor)^-1, where floor is the covariance of an independent error with the given
/// sigmas per axis. No direction ends up better known than the floor. A direction whose own sigma exceeds the floor's
/// a thousandfold counts as free and is dropped.
[[nodiscard]] WhiteningRows whitening_with_floor(const Matrix6d& information, double sigma_rotation_rad,
                                                 double sigma_position_m);

}  // namespace ignis
