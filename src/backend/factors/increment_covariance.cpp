// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/increment_covariance.h"

namespace ignis {
namespace {

constexpr int kMoving = 9;  // biases stay: the rows of F below are those of the identity
constexpr int kSize = 15;
constexpr int kPadded = 16;  // rows of a whole number of vector registers

using Rows = Eigen::Matrix<double, kSize, kPadded, Eigen::RowMajor>;

/// Calls product(row, columns...) for the moving rows of F with the columns that are not zero, in ascending order: so
/// the sums are those of the full product.
void for_each_moving_row(auto&& product) {
  for (int i = 0; i < 3; ++i) product(i, 0, 1, 2, 12, 13, 14);
  for (int i = 3; i < 6; ++i) product(i, 0, 1, 2, i, i + 3, 9, 10, 11);
  for (int i = 6; i < 9; ++i) product(i, 0, 1, 2, i, 9, 10, 11);
}

Rows padded(const auto& matrix) {
  Rows rows;
  rows.leftCols<kSize>() = matrix;
  rows.rightCols<1>().setZero();
  return rows;
}

/// Adds the noise of one sample and what the walks of the biases add.
void add_noise(Matrix15d& covariance, const IncrementStep& step, double dt, const ImuNoise& noise,
               double bias_variance) {
  const auto squared = [](double sigma) { return sigma * sigma; };
  const double bias = bias_variance / dt;
  const auto add = [&](int row, int column, const Eigen::Matrix3d& a, double variance, const Eigen::Matrix3d& b) {
    const Eigen::Matrix3d of_samples = (a * (variance / dt)).eval() * b.transpose();
    const Eigen::Matrix3d of_bias = (a * bias).eval() * b.transpose();
    Eigen::Matrix3d sum = of_samples + of_bias;
    if (row == 3 && column == 3) sum.diagonal().array() += dt * squared(noise.integration_sigma);
    covariance.block<3, 3>(row, column) += sum;
  };
  const Eigen::Matrix3d turn = step.by_gyro.topRows<3>();
  const Eigen::Matrix3d shift = step.by_accel.middleRows<3>(3);
  const Eigen::Matrix3d push = step.by_accel.bottomRows<3>();
  add(0, 0, turn, squared(noise.gyro_noise), turn);
  add(3, 3, shift, squared(noise.accel_noise), shift);
  add(3, 6, shift, squared(noise.accel_noise), push);
  add(6, 3, push, squared(noise.accel_noise), shift);
  add(6, 6, push, squared(noise.accel_noise), push);
  covariance.diagonal().segment<3>(9).array() += dt * squared(noise.accel_bias_walk);
  covariance.diagonal().segment<3>(12).array() += dt * squared(noise.gyro_bias_walk);
}

}  // namespace

void carry_over_sample(Matrix15d& covariance, const IncrementStep& step, double dt, const ImuNoise& noise,
                       double bias_variance) {
  Eigen::Matrix<double, kMoving, kSize> F = Eigen::Matrix<double, kMoving, kSize>::Zero();
  F.leftCols<9>() = step.by_increment;
  F.block<6, 3>(3, 9) = step.by_accel.bottomRows<6>();
  F.block<3, 3>(0, 12) = step.by_gyro.topRows<3>();

  const Rows P = padded(covariance);
  Rows FP = P;
  for_each_moving_row([&](int row, auto... k) { FP.row(row) = (... + (F(row, k) * P.row(k))); });
  const Rows PF = padded(FP.leftCols<kSize>().transpose());
  covariance.topRightCorner<kMoving, 6>() = FP.block<kMoving, 6>(0, 9);
  Eigen::Matrix<double, kMoving, kPadded, Eigen::RowMajor> FPF;  // transposed
  for_each_moving_row([&](int row, auto... k) { FPF.row(row) = (... + (F(row, k) * PF.row(k))); });
  covariance.leftCols<kMoving>() = FPF.leftCols<kSize>().transpose();
  add_noise(covariance, step, dt, noise, bias_variance);
}

}  // namespace ignis
