// SPDX-License-Identifier: Apache-2.0
#include "frontend/start_tilt.h"

#include <gtest/gtest.h>

#include <numbers>

#include "common/so3.h"

namespace ignis {
namespace {

constexpr double kSigma = 0.1;
constexpr double kStep = 0.004;

/// Variance of the accelerometer bias that a turn of two seconds at `rate` about `axis` of the body adds.
Eigen::Vector3d added(const Eigen::Quaterniond& attitude, const Eigen::Vector3d& axis, double rate) {
  NavState state;
  state.T_odom_body.rotation = attitude;
  state.gyro_bias = {0.01, -0.02, 0.03};
  InertialInput input;
  input.gyro = state.gyro_bias + rate * axis;
  Matrix15d covariance = Matrix15d::Zero();
  for (int i = 0; i < 500; ++i) widen_by_turn(covariance, state, input, kStep, kSigma);
  EXPECT_EQ(covariance.topLeftCorner(12, 12).norm(), 0.0);
  return covariance.diagonal().segment<3>(kAccelBias);
}

TEST(StartTilt, HalfATurnAddsWhatTwiceTheBiasMayBe) {
  // Twice the bias of a tilt of one sigma is 0.2 m/s^2; half a turn is announced with 0.17.
  const Eigen::Vector3d variance =
      added(Eigen::Quaterniond::Identity(), Eigen::Vector3d::UnitY(), 0.5 * std::numbers::pi);
  EXPECT_NEAR(std::sqrt(variance.x()), kSigma * std::sqrt(std::numbers::pi - 0.2), 1e-9);
  EXPECT_EQ(variance.x(), variance.z());
  EXPECT_EQ(added(Eigen::Quaterniond::Identity(), -Eigen::Vector3d::UnitY(), 0.5 * std::numbers::pi), variance);
}

TEST(StartTilt, RollAndPitchAreNoTurn) {
  EXPECT_EQ(added(Eigen::Quaterniond::Identity(), Eigen::Vector3d::UnitX(), 1.0).norm(), 0.0);
  EXPECT_EQ(added(Eigen::Quaterniond::Identity(), Eigen::Vector3d::UnitZ(), 1.0).norm(), 0.0);
}

TEST(StartTilt, TheTurnIsAboutTheVertical) {
  const Eigen::Quaterniond lying = so3::exp({0.0, 0.0, 0.5 * std::numbers::pi});
  EXPECT_GT(added(lying, Eigen::Vector3d::UnitX(), 1.0).x(), 0.01);
  EXPECT_NEAR(added(lying, Eigen::Vector3d::UnitY(), 1.0).x(), 0.0, 1e-12);
}

TEST(StartTilt, NoiseOfTheGyroscopeIsNoTurn) {
  EXPECT_EQ(added(Eigen::Quaterniond::Identity(), Eigen::Vector3d::UnitY(), 0.09).norm(), 0.0);
}

}  // namespace
}  // namespace ignis
