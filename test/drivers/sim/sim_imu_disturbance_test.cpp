// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/imu_disturbance.h"

#include <cmath>
#include <complex>
#include <numbers>

#include <gtest/gtest.h>

#include "drivers/sim/imu_model.h"

namespace ignis::sim {
namespace {

constexpr double kPeriod = 0.004;

/// A unit without any error; each test switches on what it is about.
ImuModelConfig perfect() {
  return {.gyro_noise = 0.0,
          .accel_noise = 0.0,
          .gyro_bias = 0.0,
          .accel_bias = 0.0,
          .gyro_bias_walk = 0.0,
          .accel_bias_walk = 0.0};
}

std::vector<ImuReading> at_rest(const ImuModelConfig& config, int samples, std::uint64_t seed = 3) {
  ImuModel model(config, Pose{}, kPeriod, seed);
  std::vector<ImuReading> readings;
  for (int i = 0; i < samples; ++i) {
    readings.push_back(model.sample(Motion{}));
    readings.back().accel.y() -= kGravity;
  }
  return readings;
}

bool equal(const std::vector<ImuReading>& a, const std::vector<ImuReading>& b) {
  return std::ranges::equal(
      a, b, [](const ImuReading& x, const ImuReading& y) { return x.gyro == y.gyro && x.accel == y.accel; });
}

ImuModelConfig everything() {
  ImuModelConfig config;
  config.gyro_limit = 0.5;
  config.accel_limit = 30.0;
  config.disturbance.drift = {.gyro = 0.02, .accel = 0.2, .time_s = 5.0};
  config.disturbance.vibration = {.mirror_gyro = 0.01, .mirror_accel = 0.5, .head_gyro = 0.02, .head_accel = 0.3};
  config.disturbance.shocks = {{.start_s = 1.0, .duration_s = 0.1, .gyro = {1, 0, 0}, .accel = {0, 100, 0}}};
  config.disturbance.random_shocks.rate_hz = 0.5;
  return config;
}

TEST(ImuDisturbance, GivesTheSameSamplesForTheSameSeedOnly) {
  EXPECT_TRUE(equal(at_rest(everything(), 5000, 4), at_rest(everything(), 5000, 4)));
  EXPECT_FALSE(equal(at_rest(everything(), 5000, 4), at_rest(everything(), 5000, 5)));
}

TEST(ImuDisturbance, LeavesTheRandomNumbersOfTheNoiseAlone) {
  ImuModelConfig shocked;
  shocked.disturbance.random_shocks.rate_hz = 0.3;
  shocked.disturbance.random_shocks.duration_s = 0.05;
  const std::vector<ImuReading> plain = at_rest(ImuModelConfig{}, 5000);
  const std::vector<ImuReading> shaken = at_rest(shocked, 5000);
  int different = 0;
  for (std::size_t i = 0; i < plain.size(); ++i) different += plain[i].accel == shaken[i].accel ? 0 : 1;
  EXPECT_GT(different, 5);
  EXPECT_LT(different, 500) << "outside the shocks every sample is the same";
}

TEST(ImuDisturbance, ClipsEachAxisAtFullScale) {
  ImuModelConfig config = perfect();
  config.gyro_limit = 2.0;
  config.accel_limit = 30.0;
  config.disturbance.shocks = {{.start_s = 0.1, .duration_s = 0.2, .gyro = {5, -1, 0}, .accel = {-80, 0, 20}}};
  const std::vector<ImuReading> readings = at_rest(config, 100);
  const ImuReading& peak = readings[50];
  EXPECT_EQ(peak.gyro.x(), 2.0);
  EXPECT_NEAR(peak.gyro.y(), -1.0, 1e-12);
  EXPECT_EQ(peak.accel.x(), -30.0);
  EXPECT_NEAR(peak.accel.z(), 20.0, 1e-12);
  int clipped = 0;
  for (const ImuReading& reading : readings) clipped += reading.accel.x() == -30.0 ? 1 : 0;
  // 80 sin(pi x) > 30 for 75.5 % of the 200 ms.
  EXPECT_NEAR(clipped * kPeriod, 0.151, 2.0 * kPeriod);
}

TEST(ImuDisturbance, HasNoFullScaleByDefault) {
  ImuModelConfig config = perfect();
  config.disturbance.shocks = {{.start_s = 0.0, .duration_s = 0.2, .gyro = {900, 0, 0}, .accel = {9000, 0, 0}}};
  EXPECT_NEAR(at_rest(config, 26)[25].accel.x(), 9000.0, 1e-6);
  EXPECT_NEAR(at_rest(config, 26)[25].gyro.x(), 900.0, 1e-6);
}

TEST(ImuDisturbance, DriftApproachesItsFinalOffsetWithItsTimeConstant) {
  ImuModelConfig config = perfect();
  config.disturbance.drift = {.gyro = 0.03, .accel = 0.4, .time_s = 4.0};
  const std::vector<ImuReading> readings = at_rest(config, 25001);
  EXPECT_EQ(readings[0].gyro.norm(), 0.0);
  EXPECT_NEAR(readings[1000].gyro.norm(), 0.03 * (1.0 - std::exp(-1.0)), 1e-12);
  EXPECT_NEAR(readings[3000].accel.norm(), 0.4 * (1.0 - std::exp(-3.0)), 1e-12);
  EXPECT_NEAR(readings[25000].gyro.norm(), 0.03, 1e-8);
  EXPECT_NEAR(readings[1000].gyro.normalized().dot(readings[25000].gyro.normalized()), 1.0, 1e-12);

  ImuModel model(config, Pose{}, kPeriod, 3);
  for (int i = 0; i < 1000; ++i) (void)model.sample(Motion{});
  EXPECT_EQ(model.gyro_bias(), readings[1000].gyro) << "the true bias holds the drift";
}

/// Amplitude of the line at a frequency in the sum of the squares of the axes, by correlation.
double line_amplitude(const std::vector<ImuReading>& readings, Eigen::Vector3d ImuReading::* quantity, double hz) {
  double square = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    std::complex<double> sum = 0.0;
    for (std::size_t i = 0; i < readings.size(); ++i) {
      const double angle = 2.0 * std::numbers::pi * hz * kPeriod * static_cast<double>(i);
      sum += (readings[i].*quantity)[axis] * std::polar(1.0, -angle);
    }
    square += std::norm(2.0 / static_cast<double>(readings.size()) * sum);
  }
  return std::sqrt(square);
}

TEST(ImuDisturbance, VibratesAtTheAliasOfTheMirrorAndAtTheLineOfTheHead) {
  ImuModelConfig config = perfect();
  config.disturbance.vibration = {.mirror_gyro = 0.004, .mirror_accel = 0.6, .head_gyro = 0.01, .head_accel = 0.3};
  const std::vector<ImuReading> readings = at_rest(config, 5000);
  // 180 Hz sampled at 250 Hz folds to 70 Hz.
  EXPECT_NEAR(line_amplitude(readings, &ImuReading::accel, 70.0), 0.6, 1e-3);
  EXPECT_NEAR(line_amplitude(readings, &ImuReading::gyro, 70.0), 0.004, 1e-5);
  EXPECT_NEAR(line_amplitude(readings, &ImuReading::accel, 20.2), 0.3, 1e-3);
  EXPECT_NEAR(line_amplitude(readings, &ImuReading::gyro, 20.2), 0.01, 1e-5);
  for (const double quiet : {10.0, 40.0, 55.0, 90.0, 110.0}) {
    EXPECT_LT(line_amplitude(readings, &ImuReading::accel, quiet), 0.01) << quiet;
  }
}

TEST(ImuDisturbance, ShocksComeAtTheirMeanRateWithTheirPeak) {
  ImuModelConfig config = perfect();
  config.disturbance.random_shocks = {.rate_hz = 0.5, .duration_s = 0.1, .gyro = 3.0, .accel = 70.0};
  const std::vector<ImuReading> readings = at_rest(config, 500000);
  int shocks = 0;
  double highest_accel = 0.0;
  double highest_gyro = 0.0;
  for (std::size_t i = 1; i < readings.size(); ++i) {
    shocks += readings[i].accel.norm() > 0.0 && readings[i - 1].accel.norm() == 0.0 ? 1 : 0;
    highest_accel = std::max(highest_accel, readings[i].accel.norm());
    highest_gyro = std::max(highest_gyro, readings[i].gyro.norm());
  }
  // Each takes 2 s of waiting and 0.1 s of its own: 952 in 2000 s, with a deviation of about 29.
  EXPECT_NEAR(shocks, 952, 90);
  EXPECT_NEAR(highest_accel, 70.0, 0.2);
  EXPECT_NEAR(highest_gyro, 3.0, 0.01);
}

}  // namespace
}  // namespace ignis::sim
