// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/plane_disagreement.h"

#include <Eigen/Eigenvalues>

#include "frontend/matching/scan_matcher.h"
#include "frontend/planes/plane_jacobian.h"
#include "frontend/planes/square_sum.h"

namespace ignis {
namespace {

// Of the largest information: below, a direction is not divided by what chance has left there.
constexpr double kLeastInformation = 1e-4;

}  // namespace

Matrix6d plane_disagreement(const Matrix6d& information, const Matrix6d& scatter) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> axes(information);
  const Vector6d known = axes.eigenvalues().cwiseMax(kLeastInformation * axes.eigenvalues()[5]);
  if (!(known[0] > 0.0) || !scatter.allFinite()) return Matrix6d::Zero();
  // In units of what the scan is told to know, noise makes the identity or less.
  const Matrix6d to_sigmas = axes.eigenvectors() * known.cwiseSqrt().cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> scattered(to_sigmas.transpose() * scatter * to_sigmas);
  const Vector6d excess = (scattered.eigenvalues().array() - 1.0).cwiseMax(0.0);
  const Matrix6d back = to_sigmas * scattered.eigenvectors();
  return back * excess.asDiagonal() * back.transpose();
}

Matrix6d ScanMatcher::disagreement(const Pose& pose) const {
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  const double base_information = 1.0 / (map_noise_ * point_variance(pose));
  SquareSum information;
  SquareSum scatter;
  for (const Constraint& constraint : constraints_) {
    const Vector6d h = plane_jacobian(R, constraint.point_body, constraint.plane.normal);
    const double z = residual(R, pose.translation, constraint);
    const double weight = base_information * constraint.weight;
    information.add(h, weight);
    scatter.add(h, weight * weight * z * z);
  }
  // Along a blind direction a few planes that are none make up what little there is.
  const Matrix6d& observed = degeneracy_.projector;
  return plane_disagreement(observed.transpose() * information.matrix() * observed,
                            observed.transpose() * scatter.matrix() * observed);
}

}  // namespace ignis
