// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/steady_motion.h"

#include <gtest/gtest.h>

#include <random>

#include "common/so3.h"

namespace ignis {
namespace {

constexpr double kGravity = 9.81;

NavState turning_state() {
  NavState state;
  state.T_odom_body = {so3::exp(Eigen::Vector3d(0.3, 0.9, -0.2)), Eigen::Vector3d(1.0, 2.0, 3.0)};
  state.v_odom = {0.7, -0.2, -1.5};
  state.gyro_bias = {0.01, -0.02, 0.03};
  state.accel_bias = {0.1, -0.2, 0.3};
  state.angular_rate = {0.1, 0.8, -0.05};
  state.gravity_tilt = {0.1, -0.05};
  return state;
}

TEST(SteadyMotion, TheInputKeepsVelocityAndTurnRateWhateverGravitysTilt) {
  NavState state = turning_state();
  const Eigen::Vector3d v_before = state.v_odom;
  const Eigen::Vector3d rate_before = state.angular_rate;
  constexpr double kStep = 1e-4;  // the input is that of the step's beginning
  for (int i = 0; i < 10'000; ++i) state = predict_nominal(state, steady_input(state, kGravity), kStep, kGravity);
  EXPECT_LT((state.v_odom - v_before).norm(), 1e-3);
  EXPECT_LT((state.angular_rate - rate_before).norm(), 1e-9);
}

TEST(SteadyMotion, GoesOnWithSpeedAndTurnRateInBodyAxes) {
  FilterState filter;
  filter.nominal.v_odom = {0.0, 0.0, -2.0};
  filter.nominal.angular_rate = {0.0, 0.5, 0.0};  // to the left
  go_on_steadily(filter, 1.0);
  EXPECT_NEAR(filter.nominal.v_odom.norm(), 2.0, 1e-12);
  EXPECT_LT((filter.nominal.v_odom - 2.0 * Eigen::Vector3d(-std::sin(0.5), 0.0, -std::cos(0.5))).norm(), 1e-12);
  const Eigen::Vector3d on_the_circle(-4.0 * (1.0 - std::cos(0.5)), 0.0, -4.0 * std::sin(0.5));
  EXPECT_LT((filter.nominal.T_odom_body.translation - on_the_circle).norm(), 0.05) << "the mean of two velocities";
}

/// The same motion with errors of the state, an unknown turn rate and an unknown acceleration.
NavState moved(const NavState& from, const ErrorVector& error, const Eigen::Vector3d& turn,
               const Eigen::Vector3d& acceleration, double seconds) {
  FilterState filter;
  filter.nominal = perturbed(from, error);
  filter.nominal.angular_rate = from.angular_rate + turn;  // what is measured by nobody has no bias
  go_on_steadily(filter, seconds);
  filter.nominal.v_odom += seconds * acceleration;
  filter.nominal.T_odom_body.translation += 0.5 * seconds * seconds * acceleration;
  return filter.nominal;
}

TEST(SteadyMotion, CovarianceIsThatOfNumericalDerivatives) {
  const NavState state = turning_state();
  constexpr double kSeconds = 0.8;
  constexpr double kStep = 1e-6;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const ErrorCovariance root = ErrorCovariance::NullaryExpr([&] { return 0.1 * normal(random); });
  FilterState filter{state, root * root.transpose()};
  const ErrorCovariance before = filter.covariance;
  go_on_steadily(filter, kSeconds);

  const auto derivative = [&](const ErrorVector& error, const Eigen::Vector3d& turn, const Eigen::Vector3d& accel) {
    const NavState plus = moved(state, kStep * error, kStep * turn, kStep * accel, kSeconds);
    const NavState minus = moved(state, -kStep * error, -kStep * turn, -kStep * accel, kSeconds);
    return ErrorVector((difference(filter.nominal, plus) - difference(filter.nominal, minus)) / (2.0 * kStep));
  };
  ErrorCovariance F;
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  for (int i = 0; i < kErrorSize; ++i) F.col(i) = derivative(ErrorVector::Unit(i), none, none);
  ErrorCovariance expected = F * before * F.transpose();
  for (int i = 0; i < 3; ++i) {
    const ErrorVector by_turn = derivative(ErrorVector::Zero(), 0.1 * Eigen::Vector3d::Unit(i), none);
    const ErrorVector by_acceleration = derivative(ErrorVector::Zero(), none, Eigen::Vector3d::Unit(i));
    expected += by_turn * by_turn.transpose() + by_acceleration * by_acceleration.transpose();
  }
  EXPECT_LT((filter.covariance - expected).cwiseAbs().maxCoeff(), 1e-7);
}

}  // namespace
}  // namespace ignis
