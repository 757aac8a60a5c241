// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/l1_beam.h"

#include <cmath>
#include <format>
#include <numbers>

namespace ignis::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kYawBiasDeg = -38.5;
constexpr double kOpticalCentreM = 0.0445;
constexpr double kMaxRangeM = 50.0;

}  // namespace

void L1BeamConfig::check(config::Offences& offences, const std::string& path) const {
  if (range_at_90_percent_m >= range_at_10_percent_m) return;
  offences.push_back({path + ".range_at_90_percent_m", std::format("{}", range_at_90_percent_m),
                      std::format("at least range_at_10_percent_m = {}", range_at_10_percent_m)});
}

Ray beam(const l1::Auxiliary& packet, std::size_t j) {
  const auto index = static_cast<double>(j);
  const double alpha = kDegree * (packet.vertical_start_deg + index * packet.vertical_step_deg);
  const double beta = kDegree * (packet.yaw_start_deg + kYawBiasDeg +
                                 index * packet.yaw_step_deg / static_cast<double>(l1::kPointsPerPacket));
  const double theta = packet.theta_rad;
  const double ksi = packet.ksi_rad;
  const double a = -std::cos(theta) * std::sin(ksi) + std::sin(theta) * std::sin(alpha) * std::cos(ksi);
  const double b = std::cos(alpha) * std::cos(ksi);
  const double c = std::sin(theta) * std::sin(ksi) + std::cos(theta) * std::sin(alpha) * std::cos(ksi);
  const double cos_beta = std::cos(beta);
  const double sin_beta = std::sin(beta);
  const double off_axis = packet.b_axis_mm * 1e-3;
  return {{off_axis * cos_beta, off_axis * sin_beta, kOpticalCentreM},
          {cos_beta * a - sin_beta * b, sin_beta * a + cos_beta * b, c}};
}

std::uint16_t range_on_grid(const L1BeamConfig& config, double range_m) {
  if (range_m < config.min_range_m || range_m >= kMaxRangeM) return 0;
  const double steps = std::round(range_m * 1e3 / config.range_grid_mm);
  return static_cast<std::uint16_t>(std::lround(steps * config.range_grid_mm));
}

}  // namespace ignis::sim
