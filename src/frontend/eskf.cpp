// SPDX-License-Identifier: Apache-2.0
#include "frontend/eskf.h"

#include "common/so3.h"

namespace ignis {
namespace {

using Block = Eigen::Matrix3d;

Eigen::Vector3d acceleration_odom(const NavState& state, const InertialInput& input, double dt, double gravity) {
  const Eigen::Vector3d rate = input.gyro - state.gyro_bias;
  const Eigen::Quaterniond q_mid = state.T_odom_body.rotation * so3::exp(0.5 * dt * rate);
  return q_mid * (input.accel - state.accel_bias) - Eigen::Vector3d(0.0, gravity, 0.0);
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

NavState perturbed(const NavState& state, const Vector15d& error) {
  NavState moved = state;
  moved.T_odom_body.rotation = (state.T_odom_body.rotation * so3::exp(error.segment<3>(kAttitude))).normalized();
  moved.T_odom_body.translation += error.segment<3>(kPosition);
  moved.v_odom += error.segment<3>(kVelocity);
  moved.gyro_bias += error.segment<3>(kGyroBias);
  moved.accel_bias += error.segment<3>(kAccelBias);
  moved.angular_rate -= error.segment<3>(kGyroBias);
  return moved;
}

Vector15d difference(const NavState& from, const NavState& to) {
  Vector15d error;
  error.segment<3>(kAttitude) = so3::log(from.T_odom_body.rotation.conjugate() * to.T_odom_body.rotation);
  error.segment<3>(kPosition) = to.T_odom_body.translation - from.T_odom_body.translation;
  error.segment<3>(kVelocity) = to.v_odom - from.v_odom;
  error.segment<3>(kGyroBias) = to.gyro_bias - from.gyro_bias;
  error.segment<3>(kAccelBias) = to.accel_bias - from.accel_bias;
  return error;
}

NavState predict_nominal(const NavState& state, const InertialInput& input, double dt, double gravity) {
  const Eigen::Vector3d acceleration = acceleration_odom(state, input, dt, gravity);
  NavState next = state;
  next.angular_rate = input.gyro - state.gyro_bias;
  next.T_odom_body.rotation = (state.T_odom_body.rotation * so3::exp(dt * next.angular_rate)).normalized();
  next.T_odom_body.translation += dt * state.v_odom + 0.5 * dt * dt * acceleration;
  next.v_odom += dt * acceleration;
  return next;
}

NavState predict_backward(const NavState& state, const InertialInput& input, double dt, double gravity) {
  NavState before = state;
  before.angular_rate = input.gyro - state.gyro_bias;
  before.T_odom_body.rotation = (state.T_odom_body.rotation * so3::exp(-dt * before.angular_rate)).normalized();
  const Eigen::Vector3d acceleration = acceleration_odom(before, input, dt, gravity);
  before.v_odom -= dt * acceleration;
  before.T_odom_body.translation -= dt * before.v_odom + 0.5 * dt * dt * acceleration;
  return before;
}

Matrix15d transition(const NavState& state, const InertialInput& input, double dt) {
  const Eigen::Vector3d phi = dt * (input.gyro - state.gyro_bias);
  const Eigen::Vector3d force = input.accel - state.accel_bias;
  const Block half_turn = so3::exp(0.5 * phi).toRotationMatrix();
  const Block R = state.T_odom_body.rotation.toRotationMatrix();
  const Block R_mid = R * half_turn;

  const Block accel_by_attitude = -R * so3::skew(half_turn * force);
  const Block accel_by_gyro_bias = 0.5 * dt * R_mid * so3::skew(force) * so3::right_jacobian(0.5 * phi);

  Matrix15d F = Matrix15d::Identity();
  F.block<3, 3>(kAttitude, kAttitude) = so3::exp(-phi).toRotationMatrix();
  F.block<3, 3>(kAttitude, kGyroBias) = -dt * so3::right_jacobian(phi);
  F.block<3, 3>(kPosition, kVelocity) = dt * Block::Identity();
  F.block<3, 3>(kPosition, kAttitude) = 0.5 * dt * dt * accel_by_attitude;
  F.block<3, 3>(kPosition, kGyroBias) = 0.5 * dt * dt * accel_by_gyro_bias;
  F.block<3, 3>(kPosition, kAccelBias) = -0.5 * dt * dt * R_mid;
  F.block<3, 3>(kVelocity, kAttitude) = dt * accel_by_attitude;
  F.block<3, 3>(kVelocity, kGyroBias) = dt * accel_by_gyro_bias;
  F.block<3, 3>(kVelocity, kAccelBias) = -dt * R_mid;
  return F;
}

void predict(FilterState& filter, const InertialInput& input, double dt, const FrontendConfig& config,
             double noise_scale) {
  if (dt <= 0.0) return;
  const Matrix15d F = transition(filter.nominal, input, dt);

  // White noise of a sample enters the step where its bias does, so the bias columns of F are its input matrix.
  Eigen::Matrix<double, 9, 6> G = F.block<9, 6>(0, kGyroBias);
  G.leftCols<3>() *= config.imu_noise_gyro * std::sqrt(noise_scale / dt);
  G.rightCols<3>() *= config.imu_noise_accel * std::sqrt(noise_scale / dt);

  Matrix15d P = F * filter.covariance * F.transpose();
  P.topLeftCorner<9, 9>() += G * G.transpose();
  P.diagonal().segment<3>(kGyroBias).array() += config.gyro_bias_walk * config.gyro_bias_walk * dt;
  P.diagonal().segment<3>(kAccelBias).array() += config.accel_bias_walk * config.accel_bias_walk * dt;
  filter.covariance = 0.5 * (P + P.transpose());
  filter.nominal = predict_nominal(filter.nominal, input, dt, config.gravity_m);
}

bool make_symmetric(Matrix15d& covariance) {
  covariance = (0.5 * (covariance + covariance.transpose())).eval();
  return covariance.allFinite() && covariance.diagonal().minCoeff() > 0.0;
}

}  // namespace ignis
