// SPDX-License-Identifier: Apache-2.0
#include "common/so3.h"

#include <algorithm>
#include <cmath>

namespace ignis::so3 {
namespace {

// Below this angle the closed forms lose digits to cancellation and their Taylor series is exact to double precision.
constexpr double kSmallAngle = 1e-4;
// rad^2. Below, what one inertial sample turns by, five terms of a series are exact to double precision: the sixth is
// below 1e-17. They cost a fifth of the sines, and lose nothing to cancellation.
constexpr double kFewTerms2 = 0.01;

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Quaterniond exp(const Eigen::Vector3d& phi) {
  const double angle2 = phi.squaredNorm();
  if (angle2 < kFewTerms2) {
    const double h2 = 0.25 * angle2;
    const Eigen::Vector3d imaginary = 0.5 * series<6, 20, 42, 72>(h2) * phi;
    return {series<2, 12, 30, 56>(h2), imaginary.x(), imaginary.y(), imaginary.z()};
  }
  const double angle = std::sqrt(angle2);
  const double half = 0.5 * angle;
  const Eigen::Vector3d imaginary = std::sin(half) / angle * phi;
  return Eigen::Quaterniond(std::cos(half), imaginary.x(), imaginary.y(), imaginary.z()).normalized();
}

Eigen::Vector3d log(const Eigen::Quaterniond& q) {
  // q and -q are one rotation: the half with w >= 0 gives the angle in [0, pi].
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d imaginary = sign * q.vec();
  const double w = sign * q.w();
  const double sine = imaginary.norm();
  if (sine < kSmallAngle) {
    return imaginary * (2.0 / w) * (1.0 - sine * sine / (3.0 * w * w));
  }
  return imaginary * (2.0 * std::atan2(sine, w) / sine);
}

Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& phi) {
  const double angle2 = phi.squaredNorm();
  const Eigen::Matrix3d S = skew(phi);
  const Eigen::Matrix3d S2 = phi * phi.transpose() - angle2 * Eigen::Matrix3d::Identity();
  if (angle2 < kFewTerms2) {
    return Eigen::Matrix3d::Identity() - (1.0 / 2.0) * series<12, 30, 56, 90>(angle2) * S +
           (1.0 / 6.0) * series<20, 42, 72, 110>(angle2) * S2;
  }
  const double angle = std::sqrt(angle2);
  return Eigen::Matrix3d::Identity() - ((1.0 - std::cos(angle)) / angle2) * S +
         ((angle - std::sin(angle)) / (angle2 * angle)) * S2;
}

Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  const Eigen::Matrix3d S = skew(phi);
  if (angle < kSmallAngle) {
    return Eigen::Matrix3d::Identity() + 0.5 * S + (1.0 / 12.0 + angle * angle / 720.0) * S * S;
  }
  const double coefficient = 1.0 / (angle * angle) - (1.0 + std::cos(angle)) / (2.0 * angle * std::sin(angle));
  return Eigen::Matrix3d::Identity() + 0.5 * S + coefficient * S * S;
}

}  // namespace ignis::so3
