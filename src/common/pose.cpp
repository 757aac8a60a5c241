// SPDX-License-Identifier: Apache-2.0
#include "common/pose.h"

#include "common/so3.h"

namespace ignis {

Pose Pose::inverse() const {
  const Eigen::Quaterniond inverse_rotation = rotation.conjugate();
  return {inverse_rotation, -(inverse_rotation * translation)};
}

Pose Pose::operator*(const Pose& other) const {
  return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
}

bool Pose::all_finite() const { return rotation.coeffs().allFinite() && translation.allFinite(); }

Pose perturbed_in_body(const Pose& pose, const Vector6d& delta) {
  return {(pose.rotation * so3::exp(delta.head<3>())).normalized(), pose.translation + pose.rotation * delta.tail<3>()};
}

Vector6d body_difference(const Pose& from, const Pose& to) {
  const Eigen::Quaterniond to_body = from.rotation.conjugate();
  Vector6d delta;
  delta << so3::log(to_body * to.rotation), to_body * (to.translation - from.translation);
  return delta;
}

Pose interpolate(const Pose& a, const Pose& b, double ratio) {
  return {a.rotation.slerp(ratio, b.rotation), (1.0 - ratio) * a.translation + ratio * b.translation};
}

}  // namespace ignis
