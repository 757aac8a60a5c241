// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>

#include "common/config_fields.h"
#include "common/pose.h"
#include "drivers/sim/imu_disturbance.h"
#include "drivers/sim/imu_reading.h"
#include "drivers/sim/trajectory.h"

namespace ignis::sim {

/// Gravity of the simulated world [m/s^2], along -Y.
inline constexpr double kGravity = 9.81;

struct ImuModelConfig {
  double gyro_noise = 0.003;
  double accel_noise = 0.06;
  double gyro_bias = 0.01;
  double accel_bias = 0.1;
  double gyro_bias_walk = 1e-5;
  double accel_bias_walk = 1e-4;
  double gyro_limit = 0.0;
  double accel_limit = 0.0;
  ImuDisturbanceConfig disturbance = {};

  void visit_fields(this auto& self, auto& visit) {
    visit.number("gyro_noise", self.gyro_noise, {0.0, 1.0}, "rad/s/sqrt(Hz)", "white noise density of the gyro");
    visit.number("accel_noise", self.accel_noise, {0.0, 10.0}, "m/s^2/sqrt(Hz)",
                 "white noise density of the accelerometer");
    visit.number("gyro_bias", self.gyro_bias, {0.0, 1.0}, "rad/s",
                 "length of the first gyro bias, in a random direction");
    visit.number("accel_bias", self.accel_bias, {0.0, 5.0}, "m/s^2",
                 "length of the first accelerometer bias, in a random direction");
    visit.number("gyro_bias_walk", self.gyro_bias_walk, {0.0, 1.0}, "rad/s^2/sqrt(Hz)", "random walk of the gyro bias");
    visit.number("accel_bias_walk", self.accel_bias_walk, {0.0, 1.0}, "m/s^3/sqrt(Hz)",
                 "random walk of the accelerometer bias");
    visit.number("gyro_limit", self.gyro_limit, {0.0, 1000.0}, "rad/s", "full scale of each gyro axis; 0: none");
    visit.number("accel_limit", self.accel_limit, {0.0, 10000.0}, "m/s^2",
                 "full scale of each accelerometer axis; 0: none");
    self.disturbance.visit_fields(visit);
  }
};

/// What a perfect unit mounted at T_body_imu reads: rigid-body acceleration at its own position (with the centripetal
/// and the angular-acceleration term of the lever arm) minus gravity.
[[nodiscard]] ImuReading ideal_imu(const Motion& motion, const Pose& T_body_imu);

/// Adds bias, bias walk, drift, white noise, vibration and shocks, all from one seed, and clips at full scale.
class ImuModel {
 public:
  ImuModel(const ImuModelConfig& config, const Pose& T_body_imu, double period_s, std::uint64_t seed);

  /// The next sample, one period after the one before.
  [[nodiscard]] ImuReading sample(const Motion& motion);

  /// True biases of the next sample, drift included, in the unit's axes.
  [[nodiscard]] Eigen::Vector3d gyro_bias() const;   ///< [rad/s]
  [[nodiscard]] Eigen::Vector3d accel_bias() const;  ///< [m/s^2]

 private:
  [[nodiscard]] Eigen::Vector3d normal_vector(double sigma);
  [[nodiscard]] double next_t() const { return static_cast<double>(sample_count_) * period_s_; }

  ImuModelConfig config_;
  Pose T_body_imu_;
  double period_s_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  Eigen::Vector3d gyro_bias_;
  Eigen::Vector3d accel_bias_;
  ImuDisturbance disturbance_;
  std::int64_t sample_count_ = 0;
};

}  // namespace ignis::sim
