// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/imu_model.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace ignis::sim {
namespace {

TEST(IdealImu, FeelsGravityUpwardAtRest) {
  const ImuReading reading = ideal_imu(Motion{}, Pose{});
  EXPECT_LT((reading.accel - Eigen::Vector3d(0, kGravity, 0)).norm(), 1e-12);
  EXPECT_EQ(reading.gyro.norm(), 0.0);
}

TEST(ImuModel, HasTheNoiseDensitiesAndBiasesOfItsConfiguration) {
  ImuModelConfig config;
  config.gyro_bias_walk = 0.0;
  config.accel_bias_walk = 0.0;
  constexpr double kPeriod = 0.004;
  ImuModel model(config, Pose{}, kPeriod, 5);
  EXPECT_NEAR(model.gyro_bias().norm(), config.gyro_bias, 1e-12);
  EXPECT_NEAR(model.accel_bias().norm(), config.accel_bias, 1e-12);
  constexpr int kSamples = 20000;
  Eigen::Vector3d gyro_sum = Eigen::Vector3d::Zero();
  double gyro_square = 0.0;
  double accel_square = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    const ImuReading reading = model.sample(Motion{});
    gyro_sum += reading.gyro;
    gyro_square += (reading.gyro - model.gyro_bias()).squaredNorm();
    accel_square += (reading.accel - model.accel_bias() - Eigen::Vector3d(0, kGravity, 0)).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(gyro_square / (3.0 * kSamples) * kPeriod), config.gyro_noise, 0.02 * config.gyro_noise);
  EXPECT_NEAR(std::sqrt(accel_square / (3.0 * kSamples) * kPeriod), config.accel_noise, 0.02 * config.accel_noise);
  EXPECT_LT((gyro_sum / kSamples - model.gyro_bias()).norm(), 0.002);
}

TEST(ImuModel, WalksItsBiasesAsARandomWalk) {
  ImuModelConfig config;
  config.gyro_bias_walk = 1e-3;
  config.accel_bias_walk = 1e-2;
  double gyro_square = 0.0;
  double accel_square = 0.0;
  constexpr int kRuns = 200;
  for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
    ImuModel model(config, Pose{}, 0.004, seed);
    const Eigen::Vector3d gyro_start = model.gyro_bias();
    const Eigen::Vector3d accel_start = model.accel_bias();
    for (int i = 0; i < 500; ++i) (void)model.sample(Motion{});
    gyro_square += (model.gyro_bias() - gyro_start).squaredNorm() / 3.0;
    accel_square += (model.accel_bias() - accel_start).squaredNorm() / 3.0;
  }
  const double root_time = std::sqrt(2.0);
  EXPECT_NEAR(std::sqrt(gyro_square / kRuns), config.gyro_bias_walk * root_time, 0.15e-3);
  EXPECT_NEAR(std::sqrt(accel_square / kRuns), config.accel_bias_walk * root_time, 0.15e-2);
}

/// The overlapping Allan deviation of one axis at an averaging time of `window` samples (IEEE Std 952, annex C).
double allan_deviation(const std::vector<double>& rates, std::size_t window, double period) {
  std::vector<double> angle{0.0};
  for (const double rate : rates) angle.push_back(angle.back() + rate * period);
  const double tau = static_cast<double>(window) * period;
  double sum = 0.0;
  const std::size_t count = angle.size() - 2 * window;
  for (std::size_t k = 0; k < count; ++k) {
    const double step = angle[k + 2 * window] - 2.0 * angle[k + window] + angle[k];
    sum += step * step;
  }
  return std::sqrt(sum / (2.0 * tau * tau * static_cast<double>(count)));
}

TEST(ImuModel, ShowsWhiteNoiseAndRandomWalkInItsAllanDeviation) {
  constexpr double kPeriod = 0.004;
  ImuModelConfig config{.gyro_noise = 0.002, .gyro_bias = 0.0, .gyro_bias_walk = 0.002};
  ImuModel model(config, Pose{}, kPeriod, 8);
  std::vector<double> rates;
  for (int i = 0; i < 250000; ++i) rates.push_back(model.sample(Motion{}).gyro.x());
  // White noise: N / sqrt(tau), slope -1/2. Random walk: K sqrt(tau / 3), slope +1/2. Each where the other is small.
  EXPECT_NEAR(allan_deviation(rates, 5, kPeriod), config.gyro_noise / std::sqrt(0.02), 0.05 * 0.0141);
  EXPECT_NEAR(allan_deviation(rates, 50, kPeriod), std::hypot(0.002 / std::sqrt(0.2), 0.002 * std::sqrt(0.2 / 3.0)),
              0.05 * 0.0045);
  EXPECT_NEAR(allan_deviation(rates, 5000, kPeriod), config.gyro_bias_walk * std::sqrt(20.0 / 3.0), 0.25 * 0.0052);
}

}  // namespace
}  // namespace ignis::sim
