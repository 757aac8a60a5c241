// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/open_shifts.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace ignis {
namespace {

// Information relative to the best known direction, of which half counts as open. As little as that: where scans hold
// the way but badly, their own factor says it, and a step of the filter's velocity is no acceleration that the IMU has
// felt. Chosen for corridor, bare corridor and open hall (docs/results/graph_consistency.md).
constexpr double kOpen = 1e-5;

}  // namespace

Eigen::Matrix3d open_shifts(const Eigen::Matrix3d& position_information) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(position_information);
  const double best = eigen.eigenvalues()(2);
  if (best <= 0.0) return Eigen::Matrix3d::Zero();
  const auto openness = [&](double information) {
    const double relative = std::max(information, 0.0) / (best * kOpen);
    return 1.0 / (1.0 + relative * relative);
  };
  return eigen.eigenvectors() * eigen.eigenvalues().unaryExpr(openness).asDiagonal() * eigen.eigenvectors().transpose();
}

ImuSum agreeing_along(const Eigen::Matrix3d& open, const NavState& from, const NavState& to, double gravity,
                      ImuSum sum) {
  const double dt = sum.duration_s;
  const Eigen::Vector3d g(0.0, -gravity, 0.0);
  const Eigen::Matrix3d R_from_map = from.T_odom_body.rotation.conjugate().toRotationMatrix();
  const Eigen::Vector3d shift = to.T_odom_body.translation - from.T_odom_body.translation;
  const Eigen::Vector3d position = R_from_map * (shift - from.v_odom * dt - 0.5 * dt * dt * g);
  const Eigen::Vector3d velocity = R_from_map * (to.v_odom - from.v_odom - dt * g);
  const Eigen::Vector<double, 9> of_imu = sum.increment + sum.by_accel_bias * (from.accel_bias - sum.accel_bias) +
                                          sum.by_gyro_bias * (from.gyro_bias - sum.gyro_bias);
  sum.increment.segment<3>(3) += open * (position - of_imu.segment<3>(3));
  sum.increment.tail<3>() += open * (velocity - of_imu.tail<3>());
  return sum;
}

}  // namespace ignis
