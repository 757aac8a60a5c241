// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/eskf.h"

#include <Eigen/Cholesky>

#include "common/so3.h"
#include "frontend/filter/error_step.h"

namespace ignis {
namespace {

using Block = Eigen::Matrix3d;

/// Acceleration in odom axes, at the attitude in the middle of a step.
Eigen::Vector3d acceleration_odom(const NavState& state, const Eigen::Quaterniond& q_mid, const InertialInput& input,
                                  double gravity) {
  return q_mid * (input.accel - state.accel_bias) + gravity * state.gravity_direction();
}

}  // namespace

InertialInput midpoint(const ImuSample& a, const ImuSample& b) {
  return {0.5 * (a.gyro + b.gyro), 0.5 * (a.accel + b.accel)};
}

ImuSample interpolate(const ImuSample& a, const ImuSample& b, Utime utime) {
  if (b.utime == a.utime) return a;
  const double ratio = static_cast<double>(utime - a.utime) / static_cast<double>(b.utime - a.utime);
  ImuSample sample = b;
  sample.utime = utime;
  sample.gyro = (1.0 - ratio) * a.gyro + ratio * b.gyro;
  sample.accel = (1.0 - ratio) * a.accel + ratio * b.accel;
  sample.saturated = a.saturated || b.saturated;
  return sample;
}

NavState perturbed(const NavState& state, const ErrorVector& error) {
  NavState moved = state;
  moved.T_odom_body.rotation = (state.T_odom_body.rotation * so3::exp(error.segment<3>(kAttitude))).normalized();
  moved.T_odom_body.translation += error.segment<3>(kPosition);
  moved.v_odom += error.segment<3>(kVelocity);
  moved.gyro_bias += error.segment<3>(kGyroBias);
  moved.accel_bias += error.segment<3>(kAccelBias);
  moved.angular_rate -= error.segment<3>(kGyroBias);
  moved.gravity_tilt += error.segment<2>(kGravityTilt);
  return moved;
}

ErrorVector difference(const NavState& from, const NavState& to) {
  ErrorVector error;
  error.segment<3>(kAttitude) = so3::log(from.T_odom_body.rotation.conjugate() * to.T_odom_body.rotation);
  error.segment<3>(kPosition) = to.T_odom_body.translation - from.T_odom_body.translation;
  error.segment<3>(kVelocity) = to.v_odom - from.v_odom;
  error.segment<3>(kGyroBias) = to.gyro_bias - from.gyro_bias;
  error.segment<3>(kAccelBias) = to.accel_bias - from.accel_bias;
  error.segment<2>(kGravityTilt) = to.gravity_tilt - from.gravity_tilt;
  return error;
}

NavState predict_nominal(const NavState& state, const InertialInput& input, double dt, double gravity) {
  NavState next = state;
  next.angular_rate = input.gyro - state.gyro_bias;
  const Eigen::Quaterniond half_turn = so3::exp(0.5 * dt * next.angular_rate);
  const Eigen::Quaterniond q_mid = state.T_odom_body.rotation * half_turn;
  const Eigen::Vector3d acceleration = acceleration_odom(state, q_mid, input, gravity);
  next.T_odom_body.rotation = (q_mid * half_turn).normalized();
  next.T_odom_body.translation += dt * state.v_odom + 0.5 * dt * dt * acceleration;
  next.v_odom += dt * acceleration;
  return next;
}

NavState predict_backward(const NavState& state, const InertialInput& input, double dt, double gravity) {
  NavState before = state;
  before.angular_rate = input.gyro - state.gyro_bias;
  const Eigen::Quaterniond half_turn = so3::exp(-0.5 * dt * before.angular_rate);
  const Eigen::Quaterniond q_mid = state.T_odom_body.rotation * half_turn;
  const Eigen::Vector3d acceleration = acceleration_odom(before, q_mid, input, gravity);
  before.T_odom_body.rotation = (q_mid * half_turn).normalized();
  before.v_odom -= dt * acceleration;
  before.T_odom_body.translation -= dt * before.v_odom + 0.5 * dt * dt * acceleration;
  return before;
}

void turn_gravity(ErrorCovariance& covariance, const Eigen::Matrix3d& turn) {
  Eigen::Matrix<double, 2, 3> tilt_by_turn = Eigen::Matrix<double, 2, 3>::Zero();
  tilt_by_turn(0, 2) = -1.0;
  tilt_by_turn(1, 0) = 1.0;
  covariance.block<2, 2>(kGravityTilt, kGravityTilt) += tilt_by_turn * turn * tilt_by_turn.transpose();
}

Eigen::Matrix<double, 3, 2> gravity_direction_by_tilt(const NavState& state) {
  Eigen::Matrix<double, 3, 2> derivative = Eigen::Matrix<double, 3, 2>::Zero();
  derivative(0, 0) = 1.0;
  derivative.row(1) = -state.gravity_tilt.transpose() / state.gravity_direction().y();
  derivative(2, 1) = 1.0;
  return derivative;
}

ErrorCovariance transition(const NavState& state, const InertialInput& input, double dt, double gravity) {
  const Eigen::Vector3d phi = dt * (input.gyro - state.gyro_bias);
  const Eigen::Vector3d force = input.accel - state.accel_bias;
  const Block half_turn = so3::exp(0.5 * phi).toRotationMatrix();
  const Block R = state.T_odom_body.rotation.toRotationMatrix();
  const Block R_mid = R * half_turn;

  const Block accel_by_attitude = -R * so3::skew(half_turn * force);
  const Block accel_by_gyro_bias = 0.5 * dt * R_mid * so3::skew(force) * so3::right_jacobian(0.5 * phi);

  ErrorCovariance F = ErrorCovariance::Identity();
  F.block<3, 3>(kAttitude, kAttitude) = (half_turn * half_turn).transpose();
  F.block<3, 3>(kAttitude, kGyroBias) = -dt * so3::right_jacobian(phi);
  F.block<3, 3>(kPosition, kVelocity) = dt * Block::Identity();
  F.block<3, 3>(kPosition, kAttitude) = 0.5 * dt * dt * accel_by_attitude;
  F.block<3, 3>(kPosition, kGyroBias) = 0.5 * dt * dt * accel_by_gyro_bias;
  F.block<3, 3>(kPosition, kAccelBias) = -0.5 * dt * dt * R_mid;
  F.block<3, 3>(kVelocity, kAttitude) = dt * accel_by_attitude;
  F.block<3, 3>(kVelocity, kGyroBias) = dt * accel_by_gyro_bias;
  F.block<3, 3>(kVelocity, kAccelBias) = -dt * R_mid;
  F.block<3, 2>(kVelocity, kGravityTilt) = dt * gravity * gravity_direction_by_tilt(state);
  F.block<3, 2>(kPosition, kGravityTilt) = 0.5 * dt * F.block<3, 2>(kVelocity, kGravityTilt);
  return F;
}

void predict(FilterState& filter, const InertialInput& input, double dt, const FrontendConfig& config,
             double noise_scale) {
  if (dt <= 0.0) return;
  ErrorStep(filter.nominal, input, dt, config, noise_scale).carry(filter.covariance);
  filter.nominal = predict_nominal(filter.nominal, input, dt, config.gravity_m);
}

Eigen::Matrix3d rest_acceleration_covariance(const FilterState& filter, double gravity) {
  const NavState& state = filter.nominal;
  const Eigen::Matrix3d R = state.T_odom_body.rotation.toRotationMatrix();
  const Eigen::Vector3d force_odom = -gravity * state.gravity_direction();
  Eigen::Matrix<double, 3, kErrorSize> J = Eigen::Matrix<double, 3, kErrorSize>::Zero();
  J.middleCols<3>(kAttitude) = -so3::skew(force_odom) * R;
  J.middleCols<3>(kAccelBias) = -R;
  J.middleCols<2>(kGravityTilt) = gravity * gravity_direction_by_tilt(state);
  return J * filter.covariance * J.transpose();
}

double largest_axis_sigma(const ErrorCovariance& covariance, ErrorBlock block) {
  return std::sqrt(covariance.diagonal().segment<3>(block).maxCoeff());
}

bool make_symmetric(ErrorCovariance& covariance) {
  covariance = (0.5 * (covariance + covariance.transpose())).eval();
  return covariance.allFinite() && covariance.diagonal().minCoeff() > 0.0;
}

bool is_covariance(const ErrorCovariance& matrix) {
  constexpr double kRounding = 1e-9;  // of a variance
  if (!matrix.allFinite()) return false;
  ErrorCovariance rounded = matrix;
  rounded.diagonal() *= 1.0 + kRounding;
  return Eigen::LLT<ErrorCovariance>(rounded).info() == Eigen::Success;
}

}  // namespace ignis
