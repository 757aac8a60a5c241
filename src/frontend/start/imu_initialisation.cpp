// SPDX-License-Identifier: Apache-2.0
#include "frontend/start/imu_initialisation.h"

#include <cmath>
#include <format>
#include <numbers>
#include <string_view>

#include "common/frames.h"

namespace ignis {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
// The first pose defines frame odom; a covariance still has to be invertible. That this frame may not be level is
// gravity's tilt in it.
constexpr double kPositionSigma = 1e-3;      // m
constexpr double kAttitudeSigma = 1e-4;      // rad
constexpr double kWideTilt = 0.5;            // the prior of gravity's: the measurement decides
constexpr double kRestVelocitySigma = 0.01;  // m/s
constexpr std::size_t kMinSamples = 2;
constexpr double kNoiseShare = 0.7;  // white noise reaches 1, a vibration 0.7 at a sixth of the sampling rate

/// Attitude without yaw that turns the mean specific force to "up".
Eigen::Quaterniond level_attitude(const Eigen::Vector3d& up_body) {
  const Eigen::Quaterniond q = Eigen::Quaterniond::FromTwoVectors(up_body, frames::up());
  frames::YawPitchRoll attitude = frames::to_yaw_pitch_roll(q);
  attitude.yaw = 0.0;
  return frames::from_yaw_pitch_roll(attitude);
}

/// Conditions a prior on the measurement "specific force = -R^T g + bias", with variance per axis. Corrects the state.
void condition_on_gravity(FilterState& filter, const Eigen::Vector3d& accel_mean, double gravity, double variance) {
  const Eigen::Matrix3d R_body_odom = filter.nominal.T_odom_body.rotation.conjugate().toRotationMatrix();
  Eigen::Matrix<double, 3, kErrorSize> H = Eigen::Matrix<double, 3, kErrorSize>::Zero();
  H.middleCols<3>(kAccelBias) = Eigen::Matrix3d::Identity();
  H.middleCols<2>(kGravityTilt) = -gravity * R_body_odom * gravity_direction_by_tilt(filter.nominal);
  const Eigen::Vector3d residual =
      accel_mean + gravity * R_body_odom * filter.nominal.gravity_direction() - filter.nominal.accel_bias;
  const Eigen::Matrix3d S = H * filter.covariance * H.transpose() + variance * Eigen::Matrix3d::Identity();
  const Eigen::Matrix<double, kErrorSize, 3> K = filter.covariance * H.transpose() * S.inverse();
  filter.nominal = perturbed(filter.nominal, K * residual);
  const ErrorCovariance I_KH = ErrorCovariance::Identity() - K * H;
  filter.covariance = I_KH * filter.covariance * I_KH.transpose() + variance * K * K.transpose();
}

/// Upright by `up_force`, and with all priors but what that force says of tilt and bias.
FilterState level_state(const FrontendConfig& config, const Eigen::Vector3d& up_force, double gyro_sigma,
                        double velocity_sigma) {
  FilterState filter;
  filter.nominal.T_odom_body.rotation = level_attitude(up_force);
  ErrorVector sigma;
  sigma << Eigen::Vector3d::Constant(kAttitudeSigma), Eigen::Vector3d::Constant(kPositionSigma),
      Eigen::Vector3d::Constant(velocity_sigma), Eigen::Vector3d::Constant(gyro_sigma),
      Eigen::Vector3d::Constant(config.accel_bias_sigma), Eigen::Vector2d::Constant(kWideTilt);
  filter.covariance = sigma.array().square().matrix().asDiagonal();
  return filter;
}

/// Why this spread is none of a vehicle at rest; empty when it may be. `noise` is the part of it from sample to sample.
std::string spread_refusal(std::string_view sensor, std::string_view unit, double sigma, double noise, double limit) {
  if (sigma <= limit) return "";
  // A vehicle that moves changes little within one sample: what comes from sample to sample is a rotor or the sensor.
  const bool noisy = noise > kNoiseShare * sigma;
  return std::format("{}: {} sigma {:.3f} {} (limit {:.3f}){}", noisy ? "noisy" : "moving", sensor, sigma, unit, limit,
                     noisy ? std::format("; if the vehicle stands, raise frontend.rest_{}_sigma", sensor) : "");
}

}  // namespace

FilterState moving_state(const FrontendConfig& config, const Eigen::Vector3d& up_force, double variance) {
  FilterState filter = level_state(config, up_force, config.gyro_bias_sigma, config.moving_velocity_sigma);
  condition_on_gravity(filter, up_force, config.gravity_m, variance);
  return filter;
}

ImuInitialisation::ImuInitialisation(const FrontendConfig& config) : config_(config) {
  config::require_valid(config, "frontend");
  report_ = std::format("waiting for {:.1f} s of IMU data", config_.start_seconds);
}

std::optional<FilterState> ImuInitialisation::add(const ImuSample& sample) {
  samples_.push_back(sample);
  const auto spans_enough = [&](std::size_t first) {
    return seconds_between(samples_[first].utime, sample.utime) >= config_.start_seconds;
  };
  if (samples_.size() < kMinSamples || !spans_enough(0)) return std::nullopt;
  while (samples_.size() > kMinSamples && spans_enough(1)) samples_.pop_front();

  const Window window = summarise();
  const bool at_rest = config_.start == "at_rest";
  const std::string reason = at_rest ? refusal(window) : refusal_in_motion(window);
  if (!reason.empty()) {
    report_ = "start refused, waiting: " + reason;
    return std::nullopt;
  }
  FilterState state = first_state(window, at_rest);
  state.nominal.utime = sample.utime;
  report_ = success(window, state, at_rest);
  return state;
}

ImuInitialisation::Window ImuInitialisation::summarise() const {
  Window window;
  const auto count = static_cast<double>(samples_.size());
  Eigen::Vector3d gyro_change = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_change = Eigen::Vector3d::Zero();
  const std::size_t half = samples_.size() / 2;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    window.gyro_mean += samples_[i].gyro / count;
    window.accel_mean += samples_[i].accel / count;
    const double share =
        i < half ? -1.0 / static_cast<double>(half) : 1.0 / static_cast<double>(samples_.size() - half);
    gyro_change += share * samples_[i].gyro;
    accel_change += share * samples_[i].accel;
  }
  Eigen::Array3d gyro_variance = Eigen::Array3d::Zero();
  Eigen::Array3d accel_variance = Eigen::Array3d::Zero();
  for (const ImuSample& sample : samples_) {
    gyro_variance += (sample.gyro - window.gyro_mean).array().square() / count;
    accel_variance += (sample.accel - window.accel_mean).array().square() / count;
  }
  window.gyro_sigma = std::sqrt(gyro_variance.maxCoeff());
  window.accel_sigma = std::sqrt(accel_variance.maxCoeff());
  Eigen::Array3d gyro_steps = Eigen::Array3d::Zero();
  Eigen::Array3d accel_steps = Eigen::Array3d::Zero();
  for (std::size_t i = 1; i < samples_.size(); ++i) {
    gyro_steps += (samples_[i].gyro - samples_[i - 1].gyro).array().square() / (2.0 * count);
    accel_steps += (samples_[i].accel - samples_[i - 1].accel).array().square() / (2.0 * count);
  }
  window.gyro_noise = std::sqrt(gyro_steps.maxCoeff());
  window.accel_noise = std::sqrt(accel_steps.maxCoeff());
  window.gyro_drift = gyro_change.norm();
  window.accel_drift = accel_change.norm();
  window.seconds = seconds_between(samples_.front().utime, samples_.back().utime);
  return window;
}

std::string ImuInitialisation::scale_refusal(const Window& window) const {
  const double norm = window.accel_mean.norm();
  if (norm > 0.9 && norm < 1.1) {
    return std::format("mean specific force is {:.3f} +- {:.3f}: this looks like g instead of m/s^2", norm,
                       window.accel_sigma);
  }
  const double band = config_.start == "at_rest" ? config_.rest_accel_band : 3.0 * config_.moving_accel_sigma;
  if (std::abs(norm - config_.gravity_m) > band) {
    return std::format(
        "mean specific force is {:.2f} m/s^2 (spread {:.2f}), not {:.2f} +- {:.2f}: scale, saturation, or motion", norm,
        window.accel_sigma, config_.gravity_m, band);
  }
  return "";
}

std::string ImuInitialisation::tilt_refusal(const Window& window, double limit) const {
  const Eigen::Vector3d& force = window.accel_mean;
  const double tilt = std::acos(std::clamp(force.normalized().dot(frames::up()), -1.0, 1.0));
  if (tilt <= limit) return "";
  const std::string measured =
      std::format("({:.2f}, {:.2f}, {:.2f}) +- {:.2f} m/s^2", force.x(), force.y(), force.z(), window.accel_sigma);
  return std::format(
      "gravity is {:.0f} degrees away from the body's up axis (limit {:.0f}), specific force {}: axes swapped or "
      "negated?",
      tilt * kDegrees, limit * kDegrees, measured);
}

/// What a vehicle in motion accelerates by looks like a tilt.
std::string ImuInitialisation::refusal_in_motion(const Window& window) const {
  std::string scale = scale_refusal(window);
  if (!scale.empty()) return scale;
  const double hidden = std::asin(std::min(3.0 * config_.moving_accel_sigma / config_.gravity_m, 1.0));
  return tilt_refusal(window, config_.max_start_tilt_rad + hidden);
}

std::string ImuInitialisation::refusal(const Window& window) const {
  std::string scale = scale_refusal(window);
  if (!scale.empty()) return scale;
  const bool accel_quiet = window.accel_sigma <= config_.rest_accel_sigma;
  const double gyro = window.gyro_mean.norm();
  if (accel_quiet && (gyro > config_.rest_gyro_mean * 6.0 || window.gyro_sigma > config_.rest_gyro_sigma * 6.0)) {
    return std::format(
        "gyro reads {:.2f} +- {:.2f} rad/s while the accelerometer is quiet: degrees per second instead of radians?",
        gyro, window.gyro_sigma);
  }
  // What the mean of white noise may be by chance is no turn: then the noise is the reason.
  const double by_chance = 3.0 * std::sqrt(3.0 / static_cast<double>(samples_.size())) * window.gyro_noise;
  std::string turning = std::format("turning at {:.3f} rad/s (limit {:.3f})", gyro, config_.rest_gyro_mean);
  if (gyro > config_.rest_gyro_mean + by_chance) return turning;
  std::string gyro_spread =
      spread_refusal("gyro", "rad/s", window.gyro_sigma, window.gyro_noise, config_.rest_gyro_sigma);
  if (!gyro_spread.empty()) return gyro_spread;
  std::string accel_spread =
      spread_refusal("accel", "m/s^2", window.accel_sigma, window.accel_noise, config_.rest_accel_sigma);
  if (!accel_spread.empty()) return accel_spread;
  if (gyro > config_.rest_gyro_mean) return turning;
  // White noise explains a difference between the means of two halves of sqrt(4 / n) sigma; motion explains more.
  const double explained = 5.0 * std::sqrt(4.0 / static_cast<double>(samples_.size()));
  if (window.accel_drift > explained * window.accel_noise + 0.05 ||
      window.gyro_drift > explained * window.gyro_noise + 0.002) {
    return std::format("moving: specific force changed by {:.2f} m/s^2, turn rate by {:.3f} rad/s within {:.1f} s",
                       window.accel_drift, window.gyro_drift, window.seconds);
  }
  return tilt_refusal(window, config_.max_start_tilt_rad);
}

FilterState ImuInitialisation::first_state(const Window& window, bool at_rest) const {
  const double variance = config_.imu_noise_accel * config_.imu_noise_accel / window.seconds;
  if (!at_rest) {
    const double hidden = config_.moving_accel_sigma * config_.moving_accel_sigma;
    FilterState filter = moving_state(config_, window.accel_mean, variance + hidden);
    filter.nominal.angular_rate = samples_.back().gyro;
    return filter;
  }
  const double gyro_noise = config_.imu_noise_gyro / std::sqrt(window.seconds);
  FilterState filter = level_state(config_, window.accel_mean, std::hypot(gyro_noise, 1e-4), kRestVelocitySigma);
  filter.nominal.gyro_bias = window.gyro_mean;
  filter.nominal.angular_rate = samples_.back().gyro - filter.nominal.gyro_bias;
  condition_on_gravity(filter, window.accel_mean, config_.gravity_m, variance);
  return filter;
}

std::string ImuInitialisation::success(const Window& window, const FilterState& state, bool at_rest) const {
  const frames::YawPitchRoll attitude = frames::to_yaw_pitch_roll(state.nominal.T_odom_body.rotation);
  const std::string level = std::format("pitch {:.2f} deg, roll {:.2f} deg from {:.2f} s of gravity",
                                        attitude.pitch * kDegrees, attitude.roll * kDegrees, window.seconds);
  if (!at_rest) {
    return std::format("started moving: {}; velocity unknown (sigma {:.1f} m/s), biases at zero", level,
                       config_.moving_velocity_sigma);
  }
  const Eigen::Vector3d& bias = state.nominal.gyro_bias;
  return std::format("started at rest: {}; gyro bias ({:.4f}, {:.4f}, {:.4f}) rad/s", level, bias.x(), bias.y(),
                     bias.z());
}

}  // namespace ignis
