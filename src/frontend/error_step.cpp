// SPDX-License-Identifier: Apache-2.0
#include "frontend/error_step.h"

#include <cmath>

namespace ignis {
namespace {

/// Calls product(row, columns...) for the moving rows of a transition matrix with the columns that are not zero, in
/// ascending order: so the sums are those of the full product.
void for_each_moving_row(auto&& product) {
  for (int i = 0; i < 3; ++i) product(kAttitude + i, 0, 1, 2, 9, 10, 11);
  for (int i = 0; i < 3; ++i) {
    product(kPosition + i, 0, 1, 2, kPosition + i, kVelocity + i, 9, 10, 11, 12, 13, 14, 15, 16);
  }
  for (int i = 0; i < 3; ++i) product(kVelocity + i, 0, 1, 2, kVelocity + i, 9, 10, 11, 12, 13, 14, 15, 16);
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
      gyro_bias_variance_(config.gyro_bias_walk * config.gyro_bias_walk * dt),
      accel_bias_variance_(config.accel_bias_walk * config.accel_bias_walk * dt) {
  // White noise of a sample enters the step where its bias does, so the bias columns of F are its input matrix.
  Eigen::Matrix<double, kMoving, 6> G = F_.block<kMoving, 6>(0, kGyroBias);
  G.leftCols<3>() *= config.imu_noise_gyro * std::sqrt(noise_scale / dt);
  G.rightCols<3>() *= config.imu_noise_accel * std::sqrt(noise_scale / dt);
  white_noise_.setZero();
  for (int k = 0; k < 6; ++k) white_noise_ += G.col(k) * G.col(k).transpose();
}

void ErrorStep::carry(ErrorCovariance& covariance) const {
  Eigen::Matrix<double, kErrorSize, kPaddedError, Eigen::RowMajor> P;
  P.leftCols<kErrorSize>() = covariance;
  P.rightCols<1>().setZero();
  Eigen::Matrix<double, kMoving, kPaddedError, Eigen::RowMajor> FP;
  for_each_moving_row([&](int row, auto... k) { FP.row(row) = (... + (F_(row, k) * P.row(k))); });

  Eigen::Matrix<double, kErrorSize, kPaddedMoving, Eigen::RowMajor> PF;  // transposed
  PF.leftCols<kMoving>() = FP.leftCols<kErrorSize>().transpose();
  PF.rightCols<1>().setZero();
  Eigen::Matrix<double, kMoving, kPaddedMoving, Eigen::RowMajor> FPF;  // transposed
  for_each_moving_row([&](int row, auto... k) { FPF.row(row) = (... + (F_(row, k) * PF.row(k))); });

  covariance.topLeftCorner<kMoving, kMoving>() = FPF.leftCols<kMoving>().transpose() + white_noise_;
  covariance.bottomLeftCorner<kConstant, kMoving>() = PF.bottomLeftCorner<kConstant, kMoving>();
  covariance.topRightCorner<kMoving, kConstant>() = PF.bottomLeftCorner<kConstant, kMoving>().transpose();
  covariance.diagonal().segment<3>(kGyroBias).array() += gyro_bias_variance_;
  covariance.diagonal().segment<3>(kAccelBias).array() += accel_bias_variance_;
  make_block_symmetric<kMoving>(covariance, 0);
  make_block_symmetric<kConstant>(covariance, kMoving);
}

}  // namespace ignis
