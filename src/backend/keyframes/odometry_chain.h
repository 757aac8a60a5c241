// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "backend/factors/information.h"
#include "common/pose.h"

namespace ignis {

/// Adjoint of a pose for tangent vectors with the attitude first: T exp(x) = exp(adjoint(T) x) T.
[[nodiscard]] Matrix6d adjoint(const Pose& pose);

/// The covariance that is as large as the larger of the two along each axis on which they compare (the axes in which
/// both are diagonal). `covariance` must be positive definite, `other` symmetric.
[[nodiscard]] Matrix6d larger_of(const Matrix6d& covariance, const Matrix6d& other);

/// What odometry alone says about any two keyframes, in constant time. A step's error, carried to axes that stay, is
/// taken for independent of the others', so the covariance between two keyframes is a difference of running sums (to
/// first order). Where no scan observes a direction that is not so: a wrong velocity makes all steps wrong alike. The
/// filter knows, so no step counts as surer than the filter's own covariance has grown over it. Places are indices of
/// nodes.
class OdometryChain {
 public:
  /// Covariances of attitude then position, body axes of this pose: `step_covariance` of the motion since the previous
  /// pose, ignored in the first one, and `pose_covariance` of T_odom_body as the filter states it.
  void append(const Pose& T_odom_body, const Matrix6d& step_covariance, const Matrix6d& pose_covariance);

  /// Lets go of places, ascending, not the newest. What is said of the others stays as it is.
  void erase(std::span<const std::size_t> places);

  [[nodiscard]] std::size_t size() const { return poses_.size(); }
  [[nodiscard]] const Pose& pose(std::size_t place) const { return poses_[place]; }

  [[nodiscard]] Pose T_from_to(std::size_t from, std::size_t to) const;

  /// Of T_from_to, in body axes of `to`; either may be the later one.
  [[nodiscard]] Matrix6d covariance(std::size_t from, std::size_t to) const;

 private:
  std::vector<Pose> poses_;
  std::vector<Matrix6d> sums_;          ///< of all steps so far, in axes of odom
  Matrix6d newest_ = Matrix6d::Zero();  ///< the filter's covariance of the newest pose, in axes of odom
};

/// Covariance of a relative pose that `rows` whiten. `background` is a full-rank information that every direction has
/// besides: it decides where the rows say nothing, and must be negligible where they do.
[[nodiscard]] Matrix6d covariance_of(const WhiteningRows& rows, const Matrix6d& background);

}  // namespace ignis
