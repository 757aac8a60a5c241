// SPDX-License-Identifier: Apache-2.0
#include "common/so3.h"

#include <algorithm>
#include <cmath>

namespace ignis::so3 {
namespace {

// Below this angle the closed forms lose digits to cancellation and their Taylor series is exact to double precision.
constexpr double kSmallAngle = 1e-4;

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Quaterniond exp(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  const double half = 0.5 * angle;
  const double scale = angle < kSmallAngle ? 0.5 - angle * angle / 48.0 : std::sin(half) / angle;
  const Eigen::Vector3d imaginary = scale * phi;
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
  const double angle = phi.norm();
  const Eigen::Matrix3d S = skew(phi);
  const double angle2 = angle * angle;
  if (angle < kSmallAngle) {
    return Eigen::Matrix3d::Identity() - (0.5 - angle2 / 24.0) * S + (1.0 / 6.0 - angle2 / 120.0) * S * S;
  }
  return Eigen::Matrix3d::Identity() - ((1.0 - std::cos(angle)) / angle2) * S +
         ((angle - std::sin(angle)) / (angle2 * angle)) * S * S;
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
