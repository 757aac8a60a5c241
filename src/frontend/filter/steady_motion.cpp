// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/steady_motion.h"

#include "common/so3.h"

namespace ignis {
namespace {

constexpr double kUnknownTurn = 0.1;   // [rad/s] sigma
constexpr double kUnknownAccel = 1.0;  // [m/s^2] sigma

}  // namespace

InertialInput steady_input(const NavState& state, double gravity) {
  const Eigen::Vector3d gravity_body = state.T_odom_body.rotation.conjugate() * state.gravity_direction() * gravity;
  return {state.angular_rate + state.gyro_bias, state.accel_bias - gravity_body};
}

void go_on_steadily(FilterState& filter, double seconds) {
  using Block = Eigen::Matrix3d;
  NavState& state = filter.nominal;
  const Block R = state.T_odom_body.rotation.toRotationMatrix();
  const Eigen::Quaterniond turn = so3::exp(state.angular_rate * seconds);
  const Block T = turn.toRotationMatrix();
  const Eigen::Vector3d u = R.transpose() * state.v_odom;
  const Eigen::Vector3d v_after = R * T * u;

  ErrorCovariance F = ErrorCovariance::Identity();
  F.block<3, 3>(kAttitude, kAttitude) = T.transpose();
  F.block<3, 3>(kVelocity, kAttitude) = R * (T * so3::skew(u) - so3::skew(T * u));
  F.block<3, 3>(kVelocity, kVelocity) = R * T * R.transpose();
  F.block<3, 3>(kPosition, kAttitude) = 0.5 * seconds * F.block<3, 3>(kVelocity, kAttitude);
  F.block<3, 3>(kPosition, kVelocity) = 0.5 * seconds * (Block::Identity() + F.block<3, 3>(kVelocity, kVelocity));

  Eigen::Matrix<double, 9, 6> G = Eigen::Matrix<double, 9, 6>::Zero();
  G.block<3, 3>(kAttitude, 0) = seconds * so3::right_jacobian(state.angular_rate * seconds);
  G.block<3, 3>(kVelocity, 0) = -R * T * so3::skew(u) * G.block<3, 3>(kAttitude, 0);
  G.block<3, 3>(kPosition, 0) = 0.5 * seconds * G.block<3, 3>(kVelocity, 0);
  G.block<3, 3>(kVelocity, 3) = seconds * Block::Identity();
  G.block<3, 3>(kPosition, 3) = 0.5 * seconds * seconds * Block::Identity();
  G.leftCols<3>() *= kUnknownTurn;
  G.rightCols<3>() *= kUnknownAccel;

  filter.covariance = F * filter.covariance * F.transpose();
  filter.covariance.topLeftCorner<9, 9>() += G * G.transpose();
  filter.covariance = (0.5 * (filter.covariance + filter.covariance.transpose())).eval();
  state.T_odom_body.translation += 0.5 * seconds * (state.v_odom + v_after);
  state.T_odom_body.rotation = (state.T_odom_body.rotation * turn).normalized();
  state.v_odom = v_after;
  state.utime += to_micros(seconds);
}

}  // namespace ignis
