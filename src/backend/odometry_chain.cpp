// SPDX-License-Identifier: Apache-2.0
#include "backend/odometry_chain.h"

#include <Eigen/Cholesky>
#include <algorithm>

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

void OdometryChain::append(const Pose& T_odom_body, const Matrix6d& step_covariance) {
  Matrix6d sum = Matrix6d::Zero();
  if (!poses_.empty()) {
    const Matrix6d to_odom = adjoint(T_odom_body);
    sum = sums_.back() + to_odom * step_covariance * to_odom.transpose();
  }
  poses_.push_back(T_odom_body);
  sums_.push_back(sum);
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
