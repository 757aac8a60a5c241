// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/preintegration.h"

#include <gtsam/navigation/CombinedImuFactor.h>

#include <format>

#include "backend/factors/gtsam_conversion.h"
#include "backend/factors/increment_covariance.h"

namespace ignis {
namespace {

constexpr double kAbsurdRate = 200.0;           // [rad/s]
constexpr double kAbsurdAcceleration = 2000.0;  // [m/s^2]
// GTSAM adds this to every step; its default, the identity, would drown the measurement.
constexpr double kBiasWhileIntegrating = 1e-10;

gtsam::Matrix3 isotropic(double sigma) { return gtsam::I_3x3 * (sigma * sigma); }

boost::shared_ptr<gtsam::PreintegrationCombinedParams> parameters(const ImuNoise& noise) {
  auto params = boost::make_shared<gtsam::PreintegrationCombinedParams>(gtsam::Vector3(0.0, -noise.gravity, 0.0));
  params->setGyroscopeCovariance(isotropic(noise.gyro_noise));
  params->setAccelerometerCovariance(isotropic(noise.accel_noise));
  params->setIntegrationCovariance(isotropic(noise.integration_sigma));
  params->setBiasOmegaCovariance(isotropic(noise.gyro_bias_walk));
  params->setBiasAccCovariance(isotropic(noise.accel_bias_walk));
  params->setBiasAccOmegaInit(gtsam::I_6x6 * kBiasWhileIntegrating);
  return params;
}

bool is_sane(const ImuSample& sample) {
  return sample.gyro.allFinite() && sample.accel.allFinite() && sample.gyro.norm() < kAbsurdRate &&
         sample.accel.norm() < kAbsurdAcceleration;
}

/// GTSAM's increment keeps its members to itself and its heirs.
class RestoredIncrement : public gtsam::TangentPreintegration {
 public:
  RestoredIncrement(const ImuSum& plain, const ImuNoise& noise)
      : TangentPreintegration(parameters(noise), gtsam::imuBias::ConstantBias(plain.accel_bias, plain.gyro_bias)) {
    deltaTij_ = plain.duration_s;
    preintegrated_ = plain.increment;
    preintegrated_H_biasAcc_ = plain.by_accel_bias;
    preintegrated_H_biasOmega_ = plain.by_gyro_bias;
  }
};

}  // namespace

std::optional<std::string> imu_problem(std::span<const ImuSample> samples, Utime start, Utime end,
                                       const ImuNoise& noise) {
  if (end <= start) return "the interval is empty";
  if (seconds_between(start, end) > noise.max_interval_s) {
    return std::format("the interval of {:.1f} s is longer than {:.1f} s", seconds_between(start, end),
                       noise.max_interval_s);
  }
  if (samples.empty()) return "there are no IMU samples";
  Utime previous = start;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Utime utime = samples[i].utime;
    if (!is_sane(samples[i])) return std::format("IMU sample {} is not finite or absurd", i);
    if (utime < start || utime >= end) return std::format("IMU sample {} lies outside the interval", i);
    if (i > 0 && utime <= previous) return std::format("IMU sample {} does not come after its predecessor", i);
    if (seconds_between(previous, utime) > noise.max_gap_s) {
      return std::format("{:.3f} s without IMU before sample {}", seconds_between(previous, utime), i);
    }
    previous = utime;
  }
  if (seconds_between(previous, end) > noise.max_gap_s) {
    return std::format("{:.3f} s without IMU at the end", seconds_between(previous, end));
  }
  return std::nullopt;
}

gtsam::PreintegratedCombinedMeasurements preintegrate(std::span<const ImuSample> samples, Utime start, Utime end,
                                                      const NavState& start_state, const ImuNoise& noise) {
  gtsam::TangentPreintegration sum(parameters(noise), bias_of(start_state));
  Matrix15d covariance = Matrix15d::Zero();
  IncrementStep step;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Utime from = i == 0 ? start : samples[i].utime;
    const Utime to = i + 1 < samples.size() ? samples[i + 1].utime : end;
    const double dt = seconds_between(from, to);
    sum.update(samples[i].accel, samples[i].gyro, dt, &step.by_increment, &step.by_accel, &step.by_gyro);
    carry_over_sample(covariance, step, dt, noise, kBiasWhileIntegrating);
  }
  return {sum, covariance};
}

ImuSum plain_sum(const gtsam::PreintegratedCombinedMeasurements& sum) {
  return {.duration_s = sum.deltaTij(),
          .gyro_bias = sum.biasHat().gyroscope(),
          .accel_bias = sum.biasHat().accelerometer(),
          .increment = sum.preintegrated(),
          .by_accel_bias = sum.preintegrated_H_biasAcc(),
          .by_gyro_bias = sum.preintegrated_H_biasOmega(),
          .covariance = sum.preintMeasCov()};
}

gtsam::PreintegratedCombinedMeasurements sum_of(const ImuSum& plain, const ImuNoise& noise) {
  return {RestoredIncrement(plain, noise), plain.covariance};
}

ImuPrediction predict_from_imu(const NavState& from, std::span<const ImuSample> samples, Utime end,
                               const ImuNoise& noise) {
  const gtsam::PreintegratedCombinedMeasurements sum = preintegrate(samples, from.utime, end, from, noise);
  const gtsam::NavState predicted =
      sum.predict(gtsam::NavState(to_gtsam(from.T_odom_body), from.v_odom), bias_of(from));
  ImuPrediction prediction;
  prediction.state = from;
  prediction.state.utime = end;
  prediction.state.T_odom_body = from_gtsam(predicted.pose());
  prediction.state.v_odom = predicted.velocity();
  prediction.covariance = sum.preintMeasCov().topLeftCorner<9, 9>();
  return prediction;
}

}  // namespace ignis
