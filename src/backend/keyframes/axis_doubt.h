// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/pose.h"

namespace ignis {

/// What the graph cannot see in its own covariance: it takes the axes along which scans say something for exact, but
/// planes tell them to a milliradian or two only. A vehicle that is off by metres along a corridor, whose axis it has
/// slightly wrong, is off by centimetres across it, where the graph is sure of millimetres. So the error of the
/// position counts as turned by a small angle at random: what is open in one direction leaks into those across it.
/// Where no direction is open by metres, as in a hall, this adds nothing that anybody could measure. (The front end
/// does the same along the directions that a scan does not observe: tilt_of_blind_shifts.)
///
/// `covariance`: of a pose, attitude then position, both in body axes; the result too.
[[nodiscard]] Matrix6d with_axis_doubt(const Matrix6d& covariance);

}  // namespace ignis
