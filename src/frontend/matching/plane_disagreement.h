// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/pose.h"

namespace ignis {

/// By how much the planes of a scan disagree on its pose, beyond what their noise explains: the part of the sandwich
/// estimate of the pose's covariance, inverse(I) S inverse(I), that exceeds inverse(I), and nothing in directions where
/// it does not. H. White, "A heteroskedasticity-consistent covariance matrix estimator and a direct test for
/// heteroskedasticity", Econometrica 48(4), 1980.
///
/// `information` I: sum of w h h^T over the points, w = 1 / variance that each is given; `scatter` S: sum of
/// w^2 z^2 h h^T, z what is left of its distance [m] at the corrected pose. Both in the order of plane_jacobian, and
/// so is what is returned [rad, m]: a positive semidefinite covariance, zero when an argument is no number. Points that
/// were too far off to be used belong to it: they do not agree for being left out. Where fewer points than some two of
/// 500 hold a direction of a room of 8 m, or ten in one of 20 m, it is taken for better known than it is, and the
/// disagreement along it is told too small.
[[nodiscard]] Matrix6d plane_disagreement(const Matrix6d& information, const Matrix6d& scatter);

}  // namespace ignis
