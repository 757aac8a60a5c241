// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/imu_disturbance.h"

#include <cmath>
#include <numbers>

namespace ignis::sim {
namespace {

constexpr std::uint64_t kDriftSeedOffset = 0xD1B54A32D192ED03ULL;
constexpr std::uint64_t kVibrationSeedOffset = 0x8CB92BA72F3D8DD7ULL;
constexpr std::uint64_t kShockSeedOffset = 0xAEF17502108EF2D9ULL;

Eigen::Vector3d random_direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  Eigen::Vector3d v;
  for (double& component : v) component = normal(random);
  return v.normalized();
}

ImuReading pulse(const ImuShock& shock, double t) {
  const double x = (t - shock.start_s) / shock.duration_s;
  if (x <= 0.0 || x >= 1.0) return {};
  const double height = std::sin(std::numbers::pi * x);
  return {height * Eigen::Vector3d(shock.gyro[0], shock.gyro[1], shock.gyro[2]),
          height * Eigen::Vector3d(shock.accel[0], shock.accel[1], shock.accel[2])};
}

}  // namespace

ImuDisturbance::ImuDisturbance(const ImuDisturbanceConfig& config, std::uint64_t seed)
    : config_(config), shock_random_(seed ^ kShockSeedOffset) {
  std::mt19937_64 drift_random(seed ^ kDriftSeedOffset);
  drift_ = random_directions(drift_random);
  std::mt19937_64 line_random(seed ^ kVibrationSeedOffset);
  const ImuVibrationConfig& vibration = config_.vibration;
  lines_.push_back(random_line(vibration.mirror_hz, vibration.mirror_gyro, vibration.mirror_accel, line_random));
  lines_.push_back(random_line(vibration.head_hz, vibration.head_gyro, vibration.head_accel, line_random));
  if (config_.random_shocks.rate_hz > 0.0) draw_next_shock(0.0);
}

ImuDisturbance::Directions ImuDisturbance::random_directions(std::mt19937_64& random) {
  const Eigen::Vector3d gyro = random_direction(random);
  return {gyro, random_direction(random)};
}

ImuDisturbance::Line ImuDisturbance::random_line(double hz, double gyro, double accel, std::mt19937_64& random) {
  const Directions directions = random_directions(random);
  std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
  const double gyro_phase = phase(random);
  return {hz, {gyro * directions.gyro, accel * directions.accel}, gyro_phase, phase(random)};
}

void ImuDisturbance::draw_next_shock(double earliest) {
  const RandomShockConfig& shocks = config_.random_shocks;
  const double wait = std::exponential_distribution<double>(shocks.rate_hz)(shock_random_);
  const Directions directions = random_directions(shock_random_);
  next_shock_ = {.start_s = earliest + wait, .duration_s = shocks.duration_s};
  for (int axis = 0; axis < 3; ++axis) {
    next_shock_.gyro[static_cast<std::size_t>(axis)] = shocks.gyro * directions.gyro[axis];
    next_shock_.accel[static_cast<std::size_t>(axis)] = shocks.accel * directions.accel[axis];
  }
}

ImuReading ImuDisturbance::drift(double t) const {
  const double share = -std::expm1(-t / config_.drift.time_s);
  return {share * config_.drift.gyro * drift_.gyro, share * config_.drift.accel * drift_.accel};
}

ImuReading ImuDisturbance::shaking(double t) {
  ImuReading sum;
  for (const Line& line : lines_) {
    const double angle = 2.0 * std::numbers::pi * line.hz * t;
    sum += {std::sin(angle + line.gyro_phase) * line.amplitude.gyro,
            std::sin(angle + line.accel_phase) * line.amplitude.accel};
  }
  for (const ImuShock& shock : config_.shocks) sum += pulse(shock, t);
  if (config_.random_shocks.rate_hz > 0.0) {
    while (t > next_shock_.start_s + next_shock_.duration_s) {
      draw_next_shock(next_shock_.start_s + next_shock_.duration_s);
    }
    sum += pulse(next_shock_, t);
  }
  return sum;
}

}  // namespace ignis::sim
