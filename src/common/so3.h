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

/// 1 - x/a (1 - x/b (1 - ...)) with a, b, ... the divisors, as the series of sines and cosines are best added up:
/// without a division, each of which the next would wait for.
template <int kFirst, int... kRest>
[[nodiscard]] constexpr double series(double x) {
  if constexpr (sizeof...(kRest) > 0) return 1.0 - x * (1.0 / kFirst) * series<kRest...>(x);
  return 1.0 - x * (1.0 / kFirst);
}

/// exp(phi) * point without a quaternion or a call of sin: Rodrigues' formula with its two coefficients as series. For
/// |phi| up to 0.5 the error is below 1e-10 of the point; beyond, use exp.
[[nodiscard]] inline Eigen::Vector3d rotate_a_little(const Eigen::Vector3d& phi, const Eigen::Vector3d& point) {
  const double a2 = phi.squaredNorm();
  const double sine = series<6, 20, 42, 72>(a2);
  const double cosine = 0.5 * series<12, 30, 56, 90>(a2);
  const Eigen::Vector3d turned = phi.cross(point);
  return point + sine * turned + cosine * phi.cross(turned);
}

/// Rotation vector of q [rad], |result| <= pi. Inverse of exp.
[[nodiscard]] Eigen::Vector3d log(const Eigen::Quaterniond& q);

/// Right Jacobian: exp(phi + d) = exp(phi) * exp(Jr(phi) d) to first order in d.
[[nodiscard]] Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& phi);

/// Inverse of right_jacobian.
[[nodiscard]] Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& phi);

}  // namespace ignis::so3
