// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/imu_model.h"

#include <gtest/gtest.h>

#include "common/so3.h"

namespace ignis::sim {
namespace {

TrajectoryConfig bend() {
  TrajectoryConfig config;
  config.corner_m = 2.0;
  config.tilt_deg = 1.0;
  config.waypoints = {{.position_m = {0, 0.6, 0}, .rest_s = 2.0},
                      {.position_m = {0, 0.6, -10}},
                      {.position_m = {8, 1.5, -10}},
                      {.position_m = {8, 1.5, -20}, .rest_s = 1.0}};
  return config;
}

Pose tilted_mount() { return {so3::exp({-0.7, 0.2, 0.4}), {0.3, -0.2, 0.5}}; }

TEST(IdealImu, IntegratesBackToTheTrajectoryOfItsOwnMount) {
  const Trajectory drive(bend());
  const Pose T_body_imu = tilted_mount();
  constexpr double kStep = 1e-3;
  Pose T_world_imu = drive.at(0.0).T_world_body * T_body_imu;
  Eigen::Vector3d v_world = Eigen::Vector3d::Zero();
  const int steps = static_cast<int>(drive.duration() / kStep);
  for (int i = 0; i < steps; ++i) {
    const ImuReading reading = ideal_imu(drive.at((i + 0.5) * kStep), T_body_imu);
    const Eigen::Quaterniond q_middle = T_world_imu.rotation * so3::exp(reading.gyro * (0.5 * kStep));
    const Eigen::Vector3d a_world = q_middle * reading.accel - Eigen::Vector3d(0.0, kGravity, 0.0);
    T_world_imu.translation += v_world * kStep + a_world * (0.5 * kStep * kStep);
    v_world += a_world * kStep;
    T_world_imu.rotation = (T_world_imu.rotation * so3::exp(reading.gyro * kStep)).normalized();
  }
  const Pose truth = drive.at(steps * kStep).T_world_body * T_body_imu;
  // The midpoint rule's own error over 25 s at 1 kHz.
  EXPECT_LT((T_world_imu.translation - truth.translation).norm(), 1e-3);
  EXPECT_LT(so3::log(truth.rotation.conjugate() * T_world_imu.rotation).norm(), 1e-5);
}

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

}  // namespace
}  // namespace ignis::sim
