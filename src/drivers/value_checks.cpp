// SPDX-License-Identifier: Apache-2.0
#include "drivers/value_checks.h"

#include <algorithm>
#include <cmath>
#include <ranges>

namespace ignis::l1 {

namespace {

constexpr float kDirectionLimitDeg = 720.0F;
constexpr float kMaxYawStepDeg = 60.0F;
constexpr float kMaxVerticalStepDeg = 3.0F;
constexpr float kMaxAxisDistanceMm = 100.0F;
constexpr float kMaxCalibrationRad = 0.5F;
/// Full scale is where readings pile up, give or take a rounding of the unit's own scale factor.
constexpr double kFullScaleTolerance = 0.005;

bool within(float value, float limit) { return std::abs(value) <= limit; }  // false for NaN

double largest(const std::array<float, 3>& values) {
  return std::ranges::max(values |
                          std::views::transform([](float value) { return std::abs(static_cast<double>(value)); }));
}

bool all_finite(const auto&... values) { return (std::isfinite(values) && ...); }

bool all_finite(const std::array<float, 3>& values) { return all_finite(values[0], values[1], values[2]); }

}  // namespace

std::string_view fault_in(const Auxiliary& message, const DriverConfig& config) {
  if (config.check_payload_size && message.payload_size != kPointsPerPacket) return "AUX payload_size";
  if (!within(message.yaw_start_deg, kDirectionLimitDeg)) return "com_horizontal_angle_start";
  if (!within(message.yaw_step_deg, kMaxYawStepDeg)) return "com_horizontal_angle_step";
  if (!within(message.vertical_start_deg, kDirectionLimitDeg)) return "sys_vertical_angle_start";
  if (!within(message.vertical_step_deg, kMaxVerticalStepDeg)) return "sys_vertical_angle_span";
  if (!within(message.b_axis_mm, kMaxAxisDistanceMm)) return "b_axis_dist";
  if (!within(message.theta_rad, kMaxCalibrationRad)) return "theta_angle";
  if (!within(message.ksi_rad, kMaxCalibrationRad)) return "ksi_angle";
  if (!all_finite(message.apd_temperature, message.dirty_index, message.imu_temperature, message.up_optical_q,
                  message.down_optical_q, message.apd_voltage) ||
      !all_finite(message.imu_angle_offset)) {
    return "AUX housekeeping";
  }
  return {};
}

std::string_view fault_in(const Distance& message, const DriverConfig& config) {
  if (config.check_payload_size && message.payload_size != 2 * kPointsPerPacket) return "DISTANCE payload_size";
  return {};
}

std::string_view fault_in(const ImuAttitude& message, const DriverConfig& config) {
  if (!all_finite(message.gyro) || largest(message.gyro) > config.gyro_limit_rad_s * (1.0 + kFullScaleTolerance)) {
    return "angular_velocity";
  }
  if (!all_finite(message.accel) || largest(message.accel) > config.accel_limit_m_s2 * (1.0 + kFullScaleTolerance)) {
    return "linear_acceleration";
  }
  double norm2 = 0.0;
  for (const float part : message.quaternion) norm2 += static_cast<double>(part) * static_cast<double>(part);
  if (!(norm2 > 0.25 && norm2 < 4.0)) return "quaternion";
  return {};
}

bool is_saturated(const ImuAttitude& message, const DriverConfig& config) {
  return largest(message.gyro) >= config.gyro_limit_rad_s * (1.0 - kFullScaleTolerance) ||
         largest(message.accel) >= config.accel_limit_m_s2 * (1.0 - kFullScaleTolerance);
}

}  // namespace ignis::l1
