// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace ignis {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

/// A rigid transform. A variable is named `T_target_source`: it takes source coordinates to target coordinates,
/// p_target = rotation * p_source + translation. Neighbours cancel in a product: T_a_c = T_a_b * T_b_c.
struct Pose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  [[nodiscard]] Pose inverse() const;
  [[nodiscard]] Pose operator*(const Pose& other) const;
  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation * point + translation; }
  [[nodiscard]] bool all_finite() const;
};

/// Right perturbation: the pose with attitude rotation * exp(delta[0..2]) and translation + rotation * delta[3..5].
/// Both halves of delta are in body axes (attitude first), the order GTSAM uses for its Pose3 tangent space.
[[nodiscard]] Pose perturbed_in_body(const Pose& pose, const Vector6d& delta);

/// The delta with perturbed_in_body(from, delta) = to.
[[nodiscard]] Vector6d body_difference(const Pose& from, const Pose& to);

/// Interpolates rotation on the shortest arc and translation linearly; ratio 0 gives `a`, 1 gives `b`.
[[nodiscard]] Pose interpolate(const Pose& a, const Pose& b, double ratio);

}  // namespace ignis
