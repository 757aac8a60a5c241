// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframes/odometry_chain.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "backend/keyframes/erase_places.h"
#include "common/so3.h"

namespace ignis {

Matrix6d adjoint(const Pose& pose) {
  const Eigen::Matrix3d R = pose.rotation.toRotationMatrix();
  Matrix6d result = Matrix6d::Zero();
  result.topLeftCorner<3, 3>() = R;
  result.bottomLeftCorner<3, 3>() = so3::skew(pose.translation) * R;
  result.bottomRightCorner<3, 3>() = R;
  return result;
}

Matrix6d larger_of(const Matrix6d& covariance, const Matrix6d& other) {
  // With covariance = L L^T, both are diagonal in the axes of the eigenvectors of L^-1 other L^-T.
  const Eigen::LLT<Matrix6d> llt(covariance);
  const Matrix6d half = llt.matrixL().solve(other);
  const Matrix6d relative = llt.matrixL().solve(half.transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(0.5 * (relative + relative.transpose()));
  if (eigen.eigenvalues()(5) <= 1.0) return covariance;
  const Matrix6d axes = llt.matrixL() * eigen.eigenvectors();
  return axes * eigen.eigenvalues().cwiseMax(1.0).asDiagonal() * axes.transpose();
}

void OdometryChain::append(const Pose& T_odom_body, const Matrix6d& step_covariance, const Matrix6d& pose_covariance) {
  const Matrix6d to_odom = adjoint(T_odom_body);
  const Matrix6d pose_in_odom = to_odom * pose_covariance * to_odom.transpose();
  Matrix6d sum = Matrix6d::Zero();
  if (!poses_.empty()) {
    const Matrix6d to_body = adjoint(T_odom_body.inverse());
    const Matrix6d growth = to_body * (pose_in_odom - newest_) * to_body.transpose();
    sum = sums_.back() + to_odom * larger_of(step_covariance, growth) * to_odom.transpose();
  }
  poses_.push_back(T_odom_body);
  sums_.push_back(sum);
  newest_ = pose_in_odom;
}

void OdometryChain::erase(std::span<const std::size_t> places) {
  erase_places(poses_, places);
  erase_places(sums_, places);
}

Pose OdometryChain::T_from_to(std::size_t from, std::size_t to) const { return poses_[from].inverse() * poses_[to]; }

Matrix6d OdometryChain::covariance(std::size_t from, std::size_t to) const {
  const auto [earlier, later] = std::minmax(from, to);
  const Matrix6d to_body = adjoint(poses_[to].inverse());
  const Matrix6d covariance = to_body * (sums_[later] - sums_[earlier]) * to_body.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

Matrix6d covariance_of(const WhiteningRows& rows, const Matrix6d& background) {
  const Matrix6d information = rows.transpose() * rows + background;
  return information.ldlt().solve(Matrix6d::Identity());
}

}  // namespace ignis
