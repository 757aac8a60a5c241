// SPDX-License-Identifier: Apache-2.0
#include "odometry_source.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "backend/keyframes/odometry_chain.h"

namespace ignis::bench {
namespace {

// Smallest sigmas that the growth is believed to have: where the filter has become surer of its pose, it would be none.
constexpr double kSmallestRotationRad = 2e-4;
constexpr double kSmallestPositionM = 1e-3;

/// Pose covariance in axes of odom: that of exp(x) T_odom_body, attitude then position.
Matrix6d in_odom(const Keyframe& keyframe) {
  Matrix6d covariance = keyframe.covariance.block<6, 6>(0, 0);
  Matrix6d to_body = Matrix6d::Identity();  // the filter tells positions in axes of odom
  to_body.bottomRightCorner<3, 3>() = keyframe.state.T_odom_body.rotation.conjugate().toRotationMatrix();
  const Matrix6d to_odom = adjoint(keyframe.state.T_odom_body) * to_body;
  return to_odom * covariance * to_odom.transpose();
}

Matrix6d inverse_with_floor(const Matrix6d& covariance) {
  Vector6d floor;
  floor << Eigen::Vector3d::Constant(kSmallestRotationRad), Eigen::Vector3d::Constant(kSmallestPositionM);
  const Matrix6d scaled = floor.cwiseInverse().asDiagonal() * covariance * floor.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(0.5 * (scaled + scaled.transpose()));
  const Vector6d information = eigen.eigenvalues().cwiseMax(1.0).cwiseInverse();
  const Matrix6d inverse = eigen.eigenvectors() * information.asDiagonal() * eigen.eigenvectors().transpose();
  return floor.cwiseInverse().asDiagonal() * inverse * floor.cwiseInverse().asDiagonal();
}

}  // namespace

void link_by_filter(std::vector<Keyframe>& keyframes) {
  for (std::size_t i = 1; i < keyframes.size(); ++i) {
    const Matrix6d to_body = adjoint(keyframes[i].state.T_odom_body.inverse());
    const Matrix6d growth = to_body * (in_odom(keyframes[i]) - in_odom(keyframes[i - 1])) * to_body.transpose();
    keyframes[i].scan_information = inverse_with_floor(growth);
  }
}

void link_by_nothing(std::vector<Keyframe>& keyframes) {
  for (Keyframe& keyframe : keyframes) keyframe.scan_information.setZero();
}

}  // namespace ignis::bench
