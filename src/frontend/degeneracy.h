// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/pose.h"

namespace ignis {

/// Which directions of a 6-dimensional pose error (attitude in body axes, position in odom axes) a scan observes.
struct DegeneracyAnalysis {
  int degenerate_directions = 0;  ///< 0..6
  Vector6d eigenvalues =
      Vector6d::Zero();  ///< mean squared sensitivity per point, ascending; 1/3 or so is well observed
  /// Projector on the observed directions, for pose errors: observed part = projector * error.
  Matrix6d projector = Matrix6d::Identity();
};

/// `sensitivity` is the mean of h h^T over the matched points, h = derivative of the point-to-plane distance. Attitude
/// is scaled by `length_m` (mean range of the points) first, so that all six eigenvalues are of one kind. Directions
/// with an eigenvalue below the threshold are degenerate. After: J. Zhang, M. Kaess, S. Singh, "On degeneracy of
/// optimization-based state estimation problems", ICRA 2016.
[[nodiscard]] DegeneracyAnalysis analyse_degeneracy(const Matrix6d& sensitivity, double length_m, double threshold);

}  // namespace ignis
