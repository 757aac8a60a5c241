// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/regained_view.h"

#include <Eigen/Eigenvalues>

namespace ignis {
namespace {

constexpr double kRegained = 1e-3;  // squared sine of an angle of two degrees between what was and what is not observed
constexpr double kMostlyAcross = 0.5;  // sine of the angle between an axis and those that there are

}  // namespace

void RegainedView::remember(const Eigen::Matrix3d& position_covariance, std::span<const Eigen::Vector3d> blind) {
  position_covariance_ = position_covariance;
  blind_ = projector_on(blind);
}

Eigen::Matrix3d RegainedView::widened(const Eigen::Matrix3d& shift, std::span<const Eigen::Vector3d> blind,
                                      const Eigen::Matrix3d& in_map) const {
  if (blind_.isZero()) return shift;
  const Eigen::Matrix3d seen = Eigen::Matrix3d::Identity() - projector_on(blind);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> regained(seen * blind_ * seen);
  std::vector<Eigen::Vector3d> axes;
  for (int k = 0; k < 3; ++k) {
    if (regained.eigenvalues()[k] > kRegained) axes.emplace_back(regained.eigenvectors().col(k));
  }
  return widened_to(position_covariance_, shift, in_map, axes);
}

void add_axis(std::vector<Eigen::Vector3d>& axes, Eigen::Vector3d axis) {
  axis -= projector_on(axes) * axis;
  if (axis.norm() > kMostlyAcross) axes.push_back(axis.normalized());
}

Eigen::Matrix3d projector_on(std::span<const Eigen::Vector3d> axes) {
  Eigen::Matrix3d projector = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& axis : axes) projector += axis * axis.transpose();
  return projector;
}

Eigen::Matrix3d widened_to(const Eigen::Matrix3d& position_covariance, Eigen::Matrix3d shift,
                           const Eigen::Matrix3d& in_map, std::span<const Eigen::Vector3d> axes) {
  for (const Eigen::Vector3d& axis : axes) {
    const double missing = axis.dot((position_covariance - in_map - shift) * axis);
    if (missing > 0.0) shift += missing * axis * axis.transpose();
  }
  return shift;
}

}  // namespace ignis
