// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

/// Rotation group helpers. Equations: J. Sola, J. Deray, D. Atchuthan, "A micro Lie theory for state estimation in
/// robotics", arXiv:1812.01537 (2018), section "SO(3)" of appendix B.
namespace ignis::so3 {

/// Matrix [v]x with [v]x w = v cross w.
[[nodiscard]] Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// Rotation of |phi| radians about phi. Exact for small angles too.
[[nodiscard]] Eigen::Quaterniond exp(const Eigen::Vector3d& phi);

/// Rotation vector of q [rad], |result| <= pi. Inverse of exp.
[[nodiscard]] Eigen::Vector3d log(const Eigen::Quaterniond& q);

/// Right Jacobian: exp(phi + d) = exp(phi) * exp(Jr(phi) d) to first order in d.
[[nodiscard]] Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& phi);

/// Inverse of right_jacobian.
[[nodiscard]] Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& phi);

}  // namespace ignis::so3
