// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/error_step.h"

namespace ignis {
namespace {

/// result = F rows for the moving rows of F. Attitude and velocity are sums over the columns that are not zero, in
/// ascending order. A constant acceleration moves the position by half of dt times what it was and what it is to the
/// velocity, so the rows of position follow from those of velocity: p' = p + dt / 2 (v + v').
void multiply_moving_rows(const ErrorCovariance& F, double dt, const auto& rows, auto& result) {
  const auto product = [&](int row, auto... k) { result.row(row) = (... + (F(row, k) * rows.row(k))); };
  for (int i = 0; i < 3; ++i) product(kAttitude + i, 0, 1, 2, 9, 10, 11);
  for (int i = 0; i < 3; ++i) {
    const int v = kVelocity + i;
    product(v, 0, 1, 2, v, 9, 10, 11, 12, 13, 14, 15, 16);
    result.row(kPosition + i) = rows.row(kPosition + i) + (0.5 * dt) * (rows.row(v) + result.row(v));
  }
}

template <int kSize>
void make_block_symmetric(ErrorCovariance& covariance, int at) {
  auto block = covariance.block<kSize, kSize>(at, at);
  block = (0.5 * (block + block.transpose())).eval();
}

}  // namespace

ErrorStep::ErrorStep(const NavState& state, const InertialInput& input, double dt, const FrontendConfig& config,
                     double noise_scale)
    : F_(transition(state, input, dt, config.gravity_m)),
      dt_(dt),
      gyro_bias_variance_(config.gyro_bias_walk * config.gyro_bias_walk * dt),
      accel_bias_variance_(config.accel_bias_walk * config.accel_bias_walk * dt) {
  // White noise of a sample enters the step where its bias does, so the bias columns of F are its input matrix. That of
  // the accelerometer is the same along all axes and so is its effect: R R^T = I.
  const double gyro_variance = config.imu_noise_gyro * config.imu_noise_gyro * noise_scale / dt;
  const double accel_variance = config.imu_noise_accel * config.imu_noise_accel * noise_scale * dt;
  const Eigen::Matrix3d attitude = F_.block<3, 3>(kAttitude, kGyroBias);
  const Eigen::Matrix3d velocity = F_.block<3, 3>(kVelocity, kGyroBias);
  const Eigen::Matrix3d attitude_attitude = gyro_variance * attitude * attitude.transpose();
  const Eigen::Matrix3d velocity_attitude = gyro_variance * velocity * attitude.transpose();
  Eigen::Matrix3d velocity_velocity = gyro_variance * velocity * velocity.transpose();
  velocity_velocity.diagonal().array() += accel_variance;
  const double half = 0.5 * dt;
  white_noise_ << attitude_attitude, half * velocity_attitude.transpose(), velocity_attitude.transpose(),
      half * velocity_attitude, half * half * velocity_velocity, half * velocity_velocity, velocity_attitude,
      half * velocity_velocity, velocity_velocity;
}

void ErrorStep::carry(ErrorCovariance& covariance) const {
  Eigen::Matrix<double, kErrorSize, kPaddedError, Eigen::RowMajor> P;
  P.leftCols<kErrorSize>() = covariance;
  P.rightCols<1>().setZero();
  Eigen::Matrix<double, kMoving, kPaddedError, Eigen::RowMajor> FP;
  multiply_moving_rows(F_, dt_, P, FP);

  Eigen::Matrix<double, kErrorSize, kPaddedMoving, Eigen::RowMajor> PF;  // transposed
  PF.leftCols<kMoving>() = FP.leftCols<kErrorSize>().transpose();
  PF.rightCols<1>().setZero();
  Eigen::Matrix<double, kMoving, kPaddedMoving, Eigen::RowMajor> FPF;  // transposed
  multiply_moving_rows(F_, dt_, PF, FPF);

  covariance.topLeftCorner<kMoving, kMoving>() = FPF.leftCols<kMoving>().transpose() + white_noise_;
  covariance.bottomLeftCorner<kConstant, kMoving>() = PF.bottomLeftCorner<kConstant, kMoving>();
  covariance.topRightCorner<kMoving, kConstant>() = PF.bottomLeftCorner<kConstant, kMoving>().transpose();
  covariance.diagonal().segment<3>(kGyroBias).array() += gyro_bias_variance_;
  covariance.diagonal().segment<3>(kAccelBias).array() += accel_bias_variance_;
  make_block_symmetric<kMoving>(covariance, 0);
  make_block_symmetric<kConstant>(covariance, kMoving);
}

}  // namespace ignis
