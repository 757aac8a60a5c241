// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "common/pose.h"

namespace ignis {

/// Derivative of a point's distance from a plane by the pose: attitude perturbed on the right, in body axes, then
/// position in odom axes (eskf.h). `R`: body to odom; `point_body` [m]; `normal` of the plane, odom axes.
///
/// Inlined into the loops over the points: a call each would take as long as what it does.
[[gnu::always_inline]] inline Vector6d plane_jacobian(const Eigen::Matrix3d& R, const Eigen::Vector3d& point_body,
                                                      const Eigen::Vector3d& normal) {
  Vector6d h;
  h << point_body.cross(R.transpose() * normal), normal;
  return h;
}

}  // namespace ignis
