// SPDX-License-Identifier: Apache-2.0
#include "frontend/start/imu_initialisation.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "common/frames.h"
#include "common/so3.h"

namespace ignis {
namespace {

const Eigen::Quaterniond kTilted = frames::from_yaw_pitch_roll({0.0, 0.1, -0.2});
const Eigen::Vector3d kGyroBias(0.01, -0.02, 0.015);

using Distortion = std::function<void(ImuSample&, double)>;

/// Feeds noisy samples of a tilted vehicle at rest, changed by `distort`; returns the first state if there is one.
std::optional<FilterState> feed(ImuInitialisation& initialisation, double seconds, const Distortion& distort = {},
                                std::uint32_t seed = 1, const Eigen::Vector3d& accel_bias = Eigen::Vector3d::Zero()) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (int i = 0; i < static_cast<int>(seconds * 250.0); ++i) {
    ImuSample sample;
    sample.utime = 4000 * (i + 1);
    sample.gyro = kGyroBias;
    sample.accel = kTilted.conjugate() * Eigen::Vector3d(0.0, 9.81, 0.0) + accel_bias;
    for (int k = 0; k < 3; ++k) sample.gyro[k] += 0.003 * std::sqrt(250.0) * normal(random);
    for (int k = 0; k < 3; ++k) sample.accel[k] += 0.06 * std::sqrt(250.0) * normal(random);
    if (distort) distort(sample, i / 250.0);
    if (auto state = initialisation.add(sample)) return state;
  }
  return std::nullopt;
}

std::string refusal(const Distortion& distort) {
  ImuInitialisation initialisation{FrontendConfig{}};
  EXPECT_FALSE(feed(initialisation, 2.0, distort).has_value());
  return initialisation.report();
}

TEST(ImuInitialisation, FindsTiltAndGyroBiasAtRest) {
  ImuInitialisation initialisation{FrontendConfig{}};
  const auto state = feed(initialisation, 3.0);
  ASSERT_TRUE(state.has_value());
  EXPECT_LT(so3::log(kTilted.conjugate() * state->nominal.T_odom_body.rotation).norm(), 0.02);
  EXPECT_NEAR(frames::to_yaw_pitch_roll(state->nominal.T_odom_body.rotation).yaw, 0.0, 1e-3);
  EXPECT_LT((state->nominal.gyro_bias - kGyroBias).norm(), 0.01);
  EXPECT_EQ(state->nominal.T_odom_body.translation.norm(), 0.0);
  EXPECT_NE(initialisation.report().find("started at rest"), std::string::npos);
}

TEST(ImuInitialisation, CovarianceCoversTheTiltErrorOfAnAccelerometerBias) {
  // NEES of tilt and accelerometer bias over seeds, with the bias drawn from its own prior.
  const FrontendConfig config;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  double nees = 0.0;
  constexpr int kRuns = 60;
  for (int run = 0; run < kRuns; ++run) {
    Eigen::Vector3d accel_bias;
    for (int k = 0; k < 3; ++k) accel_bias[k] = config.accel_bias_sigma * normal(random);
    ImuInitialisation initialisation(config);
    const auto state = feed(initialisation, 2.0, {}, static_cast<std::uint32_t>(run), accel_bias);
    ASSERT_TRUE(state.has_value()) << initialisation.report();
    // Where gravity points in the frame in which the first attitude is exact.
    const Eigen::Quaterniond& q = state->nominal.T_odom_body.rotation;
    const Eigen::Vector3d down = q * (kTilted.conjugate() * -Eigen::Vector3d::UnitY());
    Eigen::Matrix<double, 5, 1> error;
    error << accel_bias - state->nominal.accel_bias, Eigen::Vector2d(down.x(), down.z()) - state->nominal.gravity_tilt;
    const Eigen::Matrix<double, 5, 5> P = state->covariance.block<5, 5>(kAccelBias, kAccelBias);
    nees += error.dot(P.inverse() * error) / kRuns;
  }
  // Five degrees of freedom; the mean of 60 runs has a sigma of 0.41.
  EXPECT_GT(nees, 3.5);
  EXPECT_LT(nees, 6.5);
}

TEST(ImuInitialisation, SaysGInsteadOfMetresPerSecondSquared) {
  EXPECT_NE(refusal([](ImuSample& s, double) { s.accel /= 9.81; }).find("looks like g instead of m/s^2"),
            std::string::npos);
}

TEST(ImuInitialisation, SaysDegreesInsteadOfRadians) {
  EXPECT_NE(refusal([](ImuSample& s, double) { s.gyro *= 57.3; }).find("degrees per second"), std::string::npos);
}

TEST(ImuInitialisation, SaysScaleWhenGravityIsWrong) {
  EXPECT_NE(refusal([](ImuSample& s, double) { s.accel *= 1.2; }).find("scale"), std::string::npos);
}

TEST(ImuInitialisation, SaysAxesWhenGravityPointsElsewhere) {
  EXPECT_NE(refusal([](ImuSample& s, double) { s.accel = -s.accel; }).find("axes"), std::string::npos);
  EXPECT_NE(refusal([](ImuSample& s, double) { std::swap(s.accel.x(), s.accel.y()); }).find("axes"), std::string::npos);
}

TEST(ImuInitialisation, SaysAxesInMotionToo) {
  FrontendConfig config;
  config.start = "moving";
  const Distortion negated = [](ImuSample& s, double) { s.accel = -s.accel; };
  const Distortion swapped = [](ImuSample& s, double) { std::swap(s.accel.x(), s.accel.y()); };
  for (const Distortion& wrong : {negated, swapped}) {
    ImuInitialisation initialisation(config);
    EXPECT_FALSE(feed(initialisation, 2.0, wrong).has_value()) << "the map would hang upside down, or on its side";
    EXPECT_TRUE(initialisation.report().contains("axes")) << initialisation.report();
  }
}

TEST(ImuInitialisation, SaysWhatItMeasuredAndHowMuchThatSpreads) {
  EXPECT_TRUE(refusal([](ImuSample& s, double) { s.accel /= 9.81; }).contains(" +- 0."));
  EXPECT_TRUE(refusal([](ImuSample& s, double) { s.accel.setZero(); }).contains("is 0.00 m/s^2 (spread 0.00)"));
  const std::string axes = refusal([](ImuSample& s, double) { s.accel = -s.accel; });
  EXPECT_TRUE(axes.contains("specific force (") && axes.contains(") +- 0.9")) << axes;
}

TEST(ImuInitialisation, RefusesATurningVehicle) {
  EXPECT_NE(refusal([](ImuSample& s, double) { s.gyro.y() += 0.15; }).find("turning"), std::string::npos);
}

TEST(ImuInitialisation, RefusesAnAcceleratingVehicle) {
  EXPECT_NE(refusal([](ImuSample& s, double t) { s.accel.z() -= t; }).find("moving"), std::string::npos);
}

TEST(ImuInitialisation, TellsANoisySensorFromAMovingVehicle) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const std::string noisy = refusal([&](ImuSample& s, double) { s.accel.y() += 2.0 * normal(random); });
  EXPECT_TRUE(noisy.contains("noisy: accel sigma 2.")) << noisy;
  EXPECT_TRUE(noisy.contains("raise frontend.rest_accel_sigma")) << noisy;
  const std::string noisy_gyro = refusal([&](ImuSample& s, double) { s.gyro.z() += 0.3 * normal(random); });
  EXPECT_TRUE(noisy_gyro.contains("raise frontend.rest_gyro_sigma")) << noisy_gyro;
  const std::string shaken = refusal([](ImuSample& s, double t) { s.accel.x() += 4.0 * std::sin(20.0 * t); });
  EXPECT_TRUE(shaken.contains("moving: accel sigma 3.")) << shaken;
  EXPECT_FALSE(shaken.contains("raise")) << shaken;
}

/// The mean of noise is not zero either. What it may be by chance is no turn.
TEST(ImuInitialisation, TellsTheMeanOfNoiseFromATurn) {
  const double limit = FrontendConfig{}.rest_gyro_mean;
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    const std::string noisy = refusal([&](ImuSample& s, double) {
      for (int k = 0; k < 3; ++k) s.gyro[k] += 0.03 * std::sqrt(250.0) * normal(random);
    });
    EXPECT_TRUE(noisy.contains("raise frontend.rest_gyro_sigma")) << noisy;
  }
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const std::string turning =
      refusal([&](ImuSample& s, double) { s.gyro.y() += 0.03 * std::sqrt(250.0) * normal(random) + 5.0 * limit; });
  EXPECT_TRUE(turning.contains("turning")) << turning;
}

TEST(ImuInitialisation, KeepsWaitingAndStartsOnceItIsStill) {
  ImuInitialisation initialisation{FrontendConfig{}};
  const auto state = feed(initialisation, 6.0, [](ImuSample& s, double t) {
    if (t < 2.0) s.gyro.y() += 0.5;
  });
  ASSERT_TRUE(state.has_value());
  EXPECT_GT(state->nominal.utime, 3'300'000);
  EXPECT_LT((state->nominal.gyro_bias - kGyroBias).norm(), 0.02) << "the motion must not end up in the bias";
}

TEST(ImuInitialisation, MovingStartLeavesTheVelocityOpen) {
  FrontendConfig config;
  config.start = "moving";
  config.start_seconds = 0.2;
  ImuInitialisation initialisation(config);
  const auto state = feed(initialisation, 1.0, [](ImuSample& s, double) { s.gyro.y() += 0.5; });
  ASSERT_TRUE(state.has_value());
  EXPECT_NEAR(std::sqrt(state->covariance(kVelocity, kVelocity)), config.moving_velocity_sigma, 1e-9);
  EXPECT_EQ(state->nominal.gyro_bias.norm(), 0.0);
  EXPECT_NE(initialisation.report().find("started moving"), std::string::npos);
}

}  // namespace
}  // namespace ignis
