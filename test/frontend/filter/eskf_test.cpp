// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/eskf.h"

#include <gtest/gtest.h>

#include <random>

#include <Eigen/Eigenvalues>

#include "common/so3.h"
#include "frontend/filter/error_step.h"

namespace ignis {
namespace {

constexpr double kGravity = 9.81;

Eigen::Vector3d random_vector(std::mt19937& random, double scale) {
  std::uniform_real_distribution<double> uniform(-scale, scale);
  const double x = uniform(random);
  const double y = uniform(random);
  const double z = uniform(random);
  return {x, y, z};
}

NavState random_state(std::mt19937& random) {
  NavState state;
  state.T_odom_body = {so3::exp(random_vector(random, 1.5)), random_vector(random, 10.0)};
  state.v_odom = random_vector(random, 3.0);
  state.gyro_bias = random_vector(random, 0.05);
  state.accel_bias = random_vector(random, 0.3);
  state.gravity_tilt = random_vector(random, 0.2).head<2>();
  return state;
}

InertialInput random_input(std::mt19937& random) { return {random_vector(random, 3.0), random_vector(random, 15.0)}; }

TEST(Eskf, TransitionEqualsNumericalDerivative) {
  std::mt19937 random(1);
  constexpr double kStep = 1e-6;
  for (const double dt : {0.004, 0.1}) {
    for (int trial = 0; trial < 20; ++trial) {
      const NavState state = random_state(random);
      const InertialInput input = random_input(random);
      const NavState next = predict_nominal(state, input, dt, kGravity);
      ErrorCovariance numerical;
      for (int i = 0; i < kErrorSize; ++i) {
        const ErrorVector e = kStep * ErrorVector::Unit(i);
        const ErrorVector plus = difference(next, predict_nominal(perturbed(state, e), input, dt, kGravity));
        const ErrorVector minus = difference(next, predict_nominal(perturbed(state, -e), input, dt, kGravity));
        numerical.col(i) = (plus - minus) / (2.0 * kStep);
      }
      EXPECT_LT((transition(state, input, dt, kGravity) - numerical).cwiseAbs().maxCoeff(), 1e-7);
    }
  }
}

TEST(Eskf, RestAccelerationCovarianceIsThatOfNumericalDerivatives) {
  std::mt19937 random(11);
  constexpr double kStep = 1e-6;
  for (int trial = 0; trial < 20; ++trial) {
    FilterState filter;
    filter.nominal = random_state(random);
    const ErrorCovariance root = ErrorCovariance::NullaryExpr([&] { return random_vector(random, 0.1).x(); });
    filter.covariance = root * root.transpose();
    // What an IMU at rest measures if the nominal state is right; the acceleration that a wrong state makes of it.
    const Eigen::Matrix3d R = filter.nominal.T_odom_body.rotation.toRotationMatrix();
    const InertialInput rest{
        filter.nominal.gyro_bias,
        filter.nominal.accel_bias - R.transpose() * (kGravity * filter.nominal.gravity_direction())};
    const auto acceleration = [&](const ErrorVector& error) {
      const NavState state = perturbed(filter.nominal, error);
      return Eigen::Vector3d(state.T_odom_body.rotation * (rest.accel - state.accel_bias) +
                             kGravity * state.gravity_direction());
    };
    Eigen::Matrix<double, 3, kErrorSize> J;
    for (int i = 0; i < kErrorSize; ++i) {
      const ErrorVector e = kStep * ErrorVector::Unit(i);
      J.col(i) = (acceleration(e) - acceleration(-e)) / (2.0 * kStep);
    }
    const Eigen::Matrix3d expected = J * filter.covariance * J.transpose();
    EXPECT_LT((rest_acceleration_covariance(filter, kGravity) - expected).cwiseAbs().maxCoeff(), 1e-6);
  }
}

TEST(Eskf, ATurnOfTheMapMakesGravityInItAsUncertainAsThatTurnsIt) {
  // One direction of turning is enough: its shifts of gravity are numerical derivatives.
  const Eigen::Vector3d turn(0.003, 0.002, -0.001);
  const Eigen::Vector3d moved = so3::exp(turn) * -Eigen::Vector3d::UnitY();
  const Eigen::Vector2d tilt(moved.x(), moved.z());
  ErrorCovariance covariance = ErrorCovariance::Identity();
  turn_gravity(covariance, turn * turn.transpose());
  const Eigen::Matrix2d added = covariance.block<2, 2>(kGravityTilt, kGravityTilt) - Eigen::Matrix2d::Identity();
  EXPECT_LT((added - tilt * tilt.transpose()).norm(), 3e-8);
  covariance.block<2, 2>(kGravityTilt, kGravityTilt).setIdentity();
  EXPECT_TRUE(covariance.isIdentity(0.0)) << "and nothing else";
}

TEST(Eskf, DifferenceInvertsPerturbation) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const NavState state = random_state(random);
    ErrorVector error;
    for (int i = 0; i < 5; ++i) error.segment<3>(3 * i) = random_vector(random, 1.0);
    error.segment<2>(kGravityTilt) = random_vector(random, 0.2).head<2>();
    EXPECT_LT((difference(state, perturbed(state, error)) - error).norm(), 1e-12);
  }
}

TEST(Eskf, BackwardPredictionUndoesForwardPrediction) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const NavState state = random_state(random);
    const InertialInput input = random_input(random);
    const NavState back = predict_backward(predict_nominal(state, input, 0.05, kGravity), input, 0.05, kGravity);
    EXPECT_LT(difference(state, back).norm(), 1e-12);
  }
}

TEST(Eskf, KeepsVelocityZeroWhenStandingStill) {
  NavState state;
  state.T_odom_body.rotation = so3::exp(Eigen::Vector3d(0.3, 0.2, -0.1));
  const InertialInput rest{Eigen::Vector3d::Zero(),
                           state.T_odom_body.rotation.conjugate() * Eigen::Vector3d(0.0, kGravity, 0.0)};
  for (int i = 0; i < 1000; ++i) state = predict_nominal(state, rest, 0.004, kGravity);
  EXPECT_LT(state.v_odom.norm(), 1e-10);
  EXPECT_LT(state.T_odom_body.translation.norm(), 1e-10);
}

TEST(Eskf, FollowsCircularMotionInClosedForm) {
  // Forward speed v along -Z, turning left at w about +Y: centripetal acceleration points left (-X).
  constexpr double kSpeed = 2.0;
  constexpr double kRate = 0.8;
  NavState state;
  state.v_odom = {0.0, 0.0, -kSpeed};
  const InertialInput input{{0.0, kRate, 0.0}, {-kSpeed * kRate, kGravity, 0.0}};
  constexpr int kSteps = 1000;
  constexpr double kDt = 0.004;
  for (int i = 0; i < kSteps; ++i) state = predict_nominal(state, input, kDt, kGravity);
  const double angle = kRate * kSteps * kDt;
  const double radius = kSpeed / kRate;
  const Eigen::Vector3d expected(-radius * (1.0 - std::cos(angle)), 0.0, -radius * std::sin(angle));
  EXPECT_LT((state.T_odom_body.translation - expected).norm(), 1e-4);
}

TEST(Eskf, CovarianceMatchesSampledErrors) {
  // White noise on both sensors over one second; the sample covariance of the end state is the oracle.
  FrontendConfig config;
  config.gyro_bias_walk = 0.0;
  config.accel_bias_walk = 0.0;
  constexpr double kDt = 0.01;
  constexpr int kSteps = 100;
  constexpr int kRuns = 3000;
  const InertialInput nominal{{0.1, 0.4, -0.2}, {0.5, 9.5, -1.0}};
  FilterState filter;
  filter.covariance = 1e-20 * ErrorCovariance::Identity();
  for (int i = 0; i < kSteps; ++i) predict(filter, nominal, kDt, config);

  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  const double gyro_sigma = config.imu_noise_gyro / std::sqrt(kDt);
  const double accel_sigma = config.imu_noise_accel / std::sqrt(kDt);
  Eigen::Matrix<double, 9, 9> sampled = Eigen::Matrix<double, 9, 9>::Zero();
  for (int run = 0; run < kRuns; ++run) {
    NavState state;
    for (int i = 0; i < kSteps; ++i) {
      InertialInput noisy = nominal;
      for (int k = 0; k < 3; ++k) noisy.gyro[k] += gyro_sigma * normal(random);
      for (int k = 0; k < 3; ++k) noisy.accel[k] += accel_sigma * normal(random);
      state = predict_nominal(state, noisy, kDt, kGravity);
    }
    const Eigen::Matrix<double, 9, 1> error = difference(filter.nominal, state).head<9>();
    sampled += error * error.transpose() / kRuns;
  }
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(sampled(i, i) / filter.covariance(i, i), 1.0, 0.12) << "component " << i;
}

TEST(Eskf, CovarianceStaysSymmetricPositiveDefinite) {
  std::mt19937 random(5);
  const FrontendConfig config;
  FilterState filter;
  filter.covariance = 1e-6 * ErrorCovariance::Identity();
  for (int i = 0; i < 5000; ++i) predict(filter, random_input(random), 0.004, config);
  EXPECT_EQ((filter.covariance - filter.covariance.transpose()).cwiseAbs().maxCoeff(), 0.0);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<ErrorCovariance>(filter.covariance).eigenvalues()[0], 0.0);
}

TEST(ErrorStep, CarriesACovarianceAsTheProductOfTheWholeMatricesDoes) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  const FrontendConfig config;
  constexpr double kDt = 0.004;
  constexpr double kScale = 3.0;
  for (int trial = 0; trial < 20; ++trial) {
    const NavState state = random_state(random);
    const InertialInput input = random_input(random);
    const ErrorCovariance root = ErrorCovariance::NullaryExpr([&] { return normal(random); });
    const ErrorCovariance before = root * root.transpose();
    ErrorCovariance after = before;
    ErrorStep(state, input, kDt, config, kScale).carry(after);

    const ErrorCovariance F = transition(state, input, kDt, config.gravity_m);
    Eigen::Matrix<double, 6, 6> samples = Eigen::Matrix<double, 6, 6>::Identity() * kScale / kDt;
    samples.topLeftCorner<3, 3>() *= config.imu_noise_gyro * config.imu_noise_gyro;
    samples.bottomRightCorner<3, 3>() *= config.imu_noise_accel * config.imu_noise_accel;
    ErrorCovariance expected = F * before * F.transpose();
    expected.topLeftCorner<9, 9>() += F.block<9, 6>(0, kGyroBias) * samples * F.block<9, 6>(0, kGyroBias).transpose();
    expected.diagonal().segment<3>(kGyroBias).array() += config.gyro_bias_walk * config.gyro_bias_walk * kDt;
    expected.diagonal().segment<3>(kAccelBias).array() += config.accel_bias_walk * config.accel_bias_walk * kDt;
    EXPECT_LT((after - expected).cwiseAbs().maxCoeff(), 1e-13 * expected.cwiseAbs().maxCoeff());
    EXPECT_EQ((after - after.transpose()).cwiseAbs().maxCoeff(), 0.0);
  }
}

TEST(Eskf, GapMultipliesWhiteNoise) {
  const FrontendConfig config;
  FilterState healthy;
  healthy.covariance = 1e-12 * ErrorCovariance::Identity();
  FilterState gap = healthy;
  predict(healthy, {}, 0.1, config);
  predict(gap, {}, 0.1, config, 25.0);
  EXPECT_NEAR(gap.covariance(kVelocity, kVelocity) / healthy.covariance(kVelocity, kVelocity), 25.0, 0.1);
}

TEST(Eskf, InterpolatedSampleLiesOnTheLine) {
  ImuSample a;
  ImuSample b;
  a.utime = 1000;
  b.utime = 5000;
  b.gyro = {1.0, 2.0, 3.0};
  b.saturated = true;
  const ImuSample middle = interpolate(a, b, 2000);
  EXPECT_EQ(middle.utime, 2000);
  EXPECT_TRUE(middle.gyro.isApprox(0.25 * b.gyro));
  EXPECT_TRUE(middle.saturated);
}

}  // namespace
}  // namespace ignis
