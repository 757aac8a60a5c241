// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/increment_covariance.h"

#include <gtest/gtest.h>

#include <random>

namespace ignis {
namespace {

TEST(IncrementCovariance, IsThatOfTheProductsOfWholeMatrices) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto any_block = [&] { return Eigen::Matrix3d::NullaryExpr([&] { return normal(random); }).eval(); };
  const ImuNoise noise;
  constexpr double kDt = 0.004;
  constexpr double kBiasVariance = 1e-3;
  for (int trial = 0; trial < 20; ++trial) {
    // Of the shape that a step has: velocity moves the position, attitude moves all three.
    IncrementStep step;
    step.by_increment.setIdentity();
    for (int row = 0; row < 9; row += 3) step.by_increment.block<3, 3>(row, 0) = any_block();
    step.by_increment.block<3, 3>(3, 6) = kDt * Eigen::Matrix3d::Identity();
    step.by_accel << Eigen::Matrix3d::Zero(), any_block(), any_block();
    step.by_gyro << any_block(), Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero();
    const Matrix15d root = Matrix15d::NullaryExpr([&] { return normal(random); });
    const Matrix15d before = root * root.transpose();
    Matrix15d after = before;
    carry_over_sample(after, step, kDt, noise, kBiasVariance);

    Matrix15d F = Matrix15d::Identity();
    F.topLeftCorner<9, 9>() = step.by_increment;
    F.block<9, 3>(0, 9) = step.by_accel;
    F.block<9, 3>(0, 12) = step.by_gyro;
    Eigen::Matrix<double, 9, 6> G;
    G << step.by_accel, step.by_gyro;
    Vector6d variances;
    variances << Eigen::Vector3d::Constant((noise.accel_noise * noise.accel_noise + kBiasVariance) / kDt),
        Eigen::Vector3d::Constant((noise.gyro_noise * noise.gyro_noise + kBiasVariance) / kDt);
    Matrix15d expected = F * before * F.transpose();
    expected.topLeftCorner<9, 9>() += G * variances.asDiagonal() * G.transpose();
    expected.diagonal().segment<3>(3).array() += kDt * noise.integration_sigma * noise.integration_sigma;
    expected.diagonal().segment<3>(9).array() += kDt * noise.accel_bias_walk * noise.accel_bias_walk;
    expected.diagonal().segment<3>(12).array() += kDt * noise.gyro_bias_walk * noise.gyro_bias_walk;
    EXPECT_LT((after - expected).cwiseAbs().maxCoeff(), 1e-13 * expected.cwiseAbs().maxCoeff());
  }
}

}  // namespace
}  // namespace ignis
