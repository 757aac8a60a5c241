// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "common/config_fields.h"
#include "common/measurements.h"
#include "common/nav_state.h"

namespace gtsam {
class PreintegratedCombinedMeasurements;
}

/// IMU preintegration over the interval between two keyframes. Equations: C. Forster, L. Carlone, F. Dellaert,
/// D. Scaramuzza, "On-manifold preintegration for real-time visual-inertial odometry", T-RO 33(1), 2017, as implemented
/// by GTSAM (tangent-space variant). World: +Y up, gravity (0, -g, 0).
namespace ignis {

/// Noise of the inertial unit as the graph assumes it: square roots of spectral densities.
struct ImuNoise {
  double gravity = 9.81;            ///< [m/s^2]
  double gyro_noise = 0.003;        ///< [rad/s/sqrt(Hz)]
  double accel_noise = 0.06;        ///< [m/s^2/sqrt(Hz)]
  double gyro_bias_walk = 1e-4;     ///< [rad/s^2/sqrt(Hz)]
  double accel_bias_walk = 1e-3;    ///< [m/s^3/sqrt(Hz)]
  double integration_sigma = 1e-4;  ///< [m/sqrt(s)] position error of the integration itself
  double max_gap_s = 0.3;           ///< a longer pause between samples makes the interval unusable
  double max_interval_s = 12.0;     ///< a longer interval is not preintegrated

  void visit_fields(this auto& self, auto& visit) {
    visit.number("gravity", self.gravity, {9.7, 9.9}, "m/s^2", "magnitude of gravity");
    visit.number("gyro_noise", self.gyro_noise, {1e-6, 1.0}, "rad/s/sqrt(Hz)", "noise density of the gyro");
    visit.number("accel_noise", self.accel_noise, {1e-5, 10.0}, "m/s^2/sqrt(Hz)", "noise density of the accelerometer");
    visit.number("gyro_bias_walk", self.gyro_bias_walk, {1e-8, 0.1}, "rad/s^2/sqrt(Hz)",
                 "random walk of the gyro bias");
    visit.number("accel_bias_walk", self.accel_bias_walk, {1e-7, 1.0}, "m/s^3/sqrt(Hz)",
                 "random walk of the accelerometer bias");
    visit.number("integration_sigma", self.integration_sigma, {1e-7, 1.0}, "m/sqrt(s)",
                 "position error of the integration itself");
    visit.number("max_gap_s", self.max_gap_s, {0.001, 5.0}, "s", "longest pause between samples");
    visit.number("max_interval_s", self.max_interval_s, {0.1, 120.0}, "s", "longest interval that is preintegrated");
  }
};

/// Why the samples cannot be preintegrated from `start` to `end`, or nothing when they can: empty, non-finite or absurd
/// values, stamps that do not ascend or leave the interval, a pause or an interval that is too long.
[[nodiscard]] std::optional<std::string> imu_problem(std::span<const ImuSample> samples, Utime start, Utime end,
                                                     const ImuNoise& noise);

/// Each sample holds until the next one, the first from `start`, the last until `end`. Requires imu_problem() to be
/// silent. `start_state` gives the biases alone.
[[nodiscard]] gtsam::PreintegratedCombinedMeasurements preintegrate(std::span<const ImuSample> samples, Utime start,
                                                                    Utime end, const NavState& start_state,
                                                                    const ImuNoise& noise);

/// What preintegration leaves of the samples, as plain numbers: enough to make the factor again.
struct ImuSum {
  double duration_s = 0.0;
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   ///< [rad/s] that the sum assumes
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  ///< [m/s^2]
  /// Rotation vector, position and velocity increments, axes of the start.
  Eigen::Vector<double, 9> increment = Eigen::Vector<double, 9>::Zero();
  Eigen::Matrix<double, 9, 3> by_accel_bias = Eigen::Matrix<double, 9, 3>::Zero();  ///< derivatives of the increment
  Eigen::Matrix<double, 9, 3> by_gyro_bias = Eigen::Matrix<double, 9, 3>::Zero();
  /// Attitude, position, velocity, accelerometer bias, gyro bias.
  Eigen::Matrix<double, 15, 15> covariance = Eigen::Matrix<double, 15, 15>::Zero();
};

[[nodiscard]] ImuSum plain_sum(const gtsam::PreintegratedCombinedMeasurements& sum);

/// Equal to the sum of which `plain` was made, given the same `noise`.
[[nodiscard]] gtsam::PreintegratedCombinedMeasurements sum_of(const ImuSum& plain, const ImuNoise& noise);

/// Where the IMU alone says that the vehicle is at `end`.
struct ImuPrediction {
  NavState state;
  /// 9x9: attitude, position, velocity, all in body axes of the start; white noise of the samples alone.
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
};

/// Dead reckoning from `from` to `end`. Requires imu_problem() to be silent for [from.utime, end].
[[nodiscard]] ImuPrediction predict_from_imu(const NavState& from, std::span<const ImuSample> samples, Utime end,
                                             const ImuNoise& noise);

}  // namespace ignis
