// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/imu_model.h"

#include <cmath>

namespace ignis::sim {
namespace {

Eigen::Vector3d clipped(const Eigen::Vector3d& v, double limit) {
  return limit > 0.0 ? Eigen::Vector3d(v.cwiseMin(limit).cwiseMax(-limit)) : v;
}

}  // namespace

ImuReading ideal_imu(const Motion& motion, const Pose& T_body_imu) {
  const Eigen::Vector3d& lever = T_body_imu.translation;
  const Eigen::Vector3d& rate = motion.rate_body;
  const Eigen::Vector3d gravity_world(0.0, -kGravity, 0.0);
  const Eigen::Vector3d force_body = motion.T_world_body.rotation.conjugate() * (motion.a_world - gravity_world) +
                                     motion.rate_derivative_body.cross(lever) + rate.cross(rate.cross(lever));
  const Eigen::Quaterniond q_imu_body = T_body_imu.rotation.conjugate();
  return {q_imu_body * rate, q_imu_body * force_body};
}

ImuModel::ImuModel(const ImuModelConfig& config, const Pose& T_body_imu, double period_s, std::uint64_t seed)
    : config_(config),
      T_body_imu_(T_body_imu),
      period_s_(period_s),
      random_(seed),
      disturbance_(config.disturbance, seed) {
  gyro_bias_ = config_.gyro_bias * normal_vector(1.0).normalized();
  accel_bias_ = config_.accel_bias * normal_vector(1.0).normalized();
}

ImuReading ImuModel::sample(const Motion& motion) {
  ImuReading reading = ideal_imu(motion, T_body_imu_);
  const double root_rate = 1.0 / std::sqrt(period_s_);
  reading.gyro += gyro_bias() + normal_vector(config_.gyro_noise * root_rate);
  reading.accel += accel_bias() + normal_vector(config_.accel_noise * root_rate);
  gyro_bias_ += normal_vector(config_.gyro_bias_walk * std::sqrt(period_s_));
  accel_bias_ += normal_vector(config_.accel_bias_walk * std::sqrt(period_s_));
  reading += disturbance_.shaking(next_t());
  ++sample_count_;
  return {clipped(reading.gyro, config_.gyro_limit), clipped(reading.accel, config_.accel_limit)};
}

Eigen::Vector3d ImuModel::gyro_bias() const { return gyro_bias_ + disturbance_.drift(next_t()).gyro; }
Eigen::Vector3d ImuModel::accel_bias() const { return accel_bias_ + disturbance_.drift(next_t()).accel; }

Eigen::Vector3d ImuModel::normal_vector(double sigma) {
  // One statement each: the order of evaluation inside an initialiser must not decide the random sequence.
  Eigen::Vector3d v;
  for (double& component : v) component = sigma * normal_(random_);
  return v;
}

}  // namespace ignis::sim
