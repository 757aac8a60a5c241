// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/standstill.h"

#include <algorithm>
#include <cmath>

#include "common/so3.h"
#include "frontend/filter/kalman_step.h"

namespace ignis {
namespace {

constexpr double kSigmasToBelieve = 2.0;
constexpr double kHardlyMoving = 4.0;      // times stationary_speed
constexpr double kVagueVelocity = 0.1;     // m/s
constexpr std::ptrdiff_t kMinSamples = 4;  // that a quiet window needs
constexpr Utime kLongWindowUs = 9 * (kMicrosPerSecond / 10);
constexpr Utime kDelayUs = 2 * (kMicrosPerSecond / 10);  // between standing and the correction that it leads to

struct Quiet {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< [rad/s] mean
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< [m/s^2] mean
  double gyro_sigma = 0.0;                          ///< root of the largest axis variance
  double accel_sigma = 0.0;
  Eigen::Vector3d accel_drift = Eigen::Vector3d::Zero();  ///< mean of the second half minus that of the first
};

Quiet summarise(std::span<const ImuSample> window) {
  const auto count = static_cast<double>(window.size());
  const std::size_t half = window.size() / 2;
  Quiet quiet;
  Eigen::Vector3d first_half = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < window.size(); ++i) {
    quiet.gyro += window[i].gyro / count;
    quiet.accel += window[i].accel / count;
    if (i < half) first_half += window[i].accel / static_cast<double>(half);
  }
  quiet.accel_drift =
      (quiet.accel * count - first_half * static_cast<double>(half)) / static_cast<double>(window.size() - half) -
      first_half;
  Eigen::Vector3d gyro_variance = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_variance = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : window) {
    gyro_variance += (sample.gyro - quiet.gyro).cwiseAbs2() / count;
    accel_variance += (sample.accel - quiet.accel).cwiseAbs2() / count;
  }
  quiet.gyro_sigma = std::sqrt(gyro_variance.maxCoeff());
  quiet.accel_sigma = std::sqrt(accel_variance.maxCoeff());
  return quiet;
}

/// Velocity before the newest samples, by integration back over them, attitude and biases held; mean turn rate of the
/// samples before those.
Standstill measure(std::span<const ImuSample> before, std::span<const ImuSample> newest, const FilterState& filter,
                   const FrontendConfig& config) {
  const NavState& state = filter.nominal;
  const double delay = 1e-6 * static_cast<double>(kDelayUs);
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : newest) force += sample.accel / static_cast<double>(newest.size());
  force -= state.accel_bias;
  Eigen::Vector3d rate = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : before) rate += sample.gyro / static_cast<double>(before.size());
  rate -= state.gyro_bias;
  const Eigen::Matrix3d R = state.T_odom_body.rotation.toRotationMatrix();
  Standstill standstill;
  standstill.estimate.head<3>() = state.v_odom - delay * (R * force + config.gravity_m * state.gravity_direction());
  standstill.estimate.tail<3>() = rate;
  standstill.derivative.block<3, 3>(0, kAttitude) = delay * R * so3::skew(force);
  standstill.derivative.block<3, 3>(0, kVelocity).setIdentity();
  standstill.derivative.block<3, 3>(0, kAccelBias) = delay * R;
  standstill.derivative.block<3, 2>(0, kGravityTilt) = -delay * config.gravity_m * gravity_direction_by_tilt(state);
  standstill.derivative.block<3, 3>(3, kGyroBias) = -Eigen::Matrix3d::Identity();
  const double interval = 0.5e-6 * static_cast<double>(kStandstillWindowUs);
  standstill.variance.head<3>().setConstant(config.zero_velocity_sigma * config.zero_velocity_sigma +
                                            config.imu_noise_accel * config.imu_noise_accel * delay);
  standstill.variance.tail<3>().setConstant(config.imu_noise_gyro * config.imu_noise_gyro / interval);
  return standstill;
}

/// True when the velocity gained over most of a second is more than noise and bias explain. What a correction to zero
/// takes away while the vehicle gathers speed never comes back where scans do not see the motion.
bool sets_off(std::span<const ImuSample> samples, const FilterState& filter, const FrontendConfig& config) {
  const NavState& state = filter.nominal;
  const auto begin = std::ranges::lower_bound(samples, state.utime - kLongWindowUs, {}, &ImuSample::utime);
  const auto end = std::ranges::upper_bound(samples, state.utime, {}, &ImuSample::utime);
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : std::span(begin, end)) force += sample.accel / static_cast<double>(end - begin);
  const Eigen::Vector3d acceleration =
      state.T_odom_body.rotation * (force - state.accel_bias) + config.gravity_m * state.gravity_direction();
  const double seconds = seconds_between(begin->utime, std::prev(end)->utime);
  const double noise = config.imu_noise_accel / std::sqrt(seconds);
  const double sigma =
      std::hypot(noise, std::sqrt(rest_acceleration_covariance(filter, config.gravity_m).diagonal().maxCoeff()));
  return acceleration.norm() > kStandstillSigmas * sigma;
}

/// After a drive: two sigma more would still be hardly a motion. What was felt when it set off may by chance come to
/// little while the vehicle goes on, and where scans do not see the way nothing puts a wrong zero right.
bool hardly_moves(const FilterState& filter, const FrontendConfig& config) {
  const double sigma = largest_axis_sigma(filter.covariance, kVelocity);
  return !must_move(filter, config) &&
         filter.nominal.v_odom.norm() + kSigmasToBelieve * sigma <= kHardlyMoving * config.stationary_speed;
}

}  // namespace

bool must_move(const FilterState& filter, const FrontendConfig& config, double sigmas) {
  const double sigma = largest_axis_sigma(filter.covariance, kVelocity);
  return filter.nominal.v_odom.norm() > config.stationary_speed + sigmas * sigma;
}

bool may_move(const FilterState& filter) { return largest_axis_sigma(filter.covariance, kVelocity) > kVagueVelocity; }

std::optional<Standstill> find_standstill(std::span<const ImuSample> samples, const FilterState& filter,
                                          const FrontendConfig& config, Unless unless) {
  const NavState& state = filter.nominal;
  if (unless == Unless::kItMayRoll ? !hardly_moves(filter, config) : must_move(filter, config)) return std::nullopt;

  const auto begin = std::ranges::lower_bound(samples, state.utime - kStandstillWindowUs, {}, &ImuSample::utime);
  const auto newest = std::ranges::lower_bound(samples, state.utime - kDelayUs, {}, &ImuSample::utime);
  const auto end = std::ranges::upper_bound(samples, state.utime, {}, &ImuSample::utime);
  if (begin == samples.begin() || newest - begin < kMinSamples || newest == end) return std::nullopt;
  const std::span<const ImuSample> window(begin, end);
  if (std::ranges::any_of(window, &ImuSample::saturated)) return std::nullopt;

  const Quiet quiet = summarise(window);
  const double seconds = 1e-6 * static_cast<double>(kStandstillWindowUs);
  const double gyro_limit = kStandstillSigmas * (config.imu_noise_gyro / std::sqrt(seconds) +
                                                 largest_axis_sigma(filter.covariance, kGyroBias));
  // The noise of a mean over half the window, twice: the difference of two such means.
  const double drift_limit = kStandstillSigmas * config.imu_noise_accel * std::sqrt(4.0 / seconds);
  const bool still = quiet.gyro_sigma <= config.rest_gyro_sigma && quiet.accel_sigma <= config.rest_accel_sigma &&
                     (quiet.gyro - state.gyro_bias).norm() <= gyro_limit && quiet.accel_drift.norm() <= drift_limit &&
                     std::abs((quiet.accel - state.accel_bias).norm() - config.gravity_m) <= config.rest_accel_band;
  if (!still || sets_off(samples, filter, config)) return std::nullopt;
  const auto rate_begin =
      std::ranges::lower_bound(samples, state.utime - kDelayUs - kStandstillWindowUs / 2, {}, &ImuSample::utime);
  return measure({rate_begin, newest}, {newest, end}, filter, config);
}

void correct_to_standstill(FilterState& filter, const Standstill& standstill) {
  kalman_step<6>(filter, standstill.estimate, standstill.derivative, standstill.variance);
}

}  // namespace ignis
