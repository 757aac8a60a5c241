// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/spinning_beams.h"

#include <cmath>
#include <format>
#include <numbers>

namespace ignis::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Eigen::Vector3d direction(double elevation_deg, double azimuth_deg) {
  const double elevation = kDegree * elevation_deg;
  const double azimuth = kDegree * azimuth_deg;
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation)};
}

}  // namespace

void SpinningConfig::check(config::Offences& offences, const std::string& path) const {
  const auto at_least = [&](const char* name, double value, const char* other, double least) {
    if (value >= least) return;
    offences.push_back({path + '.' + name, std::format("{}", value), std::format("at least {} = {}", other, least)});
  };
  at_least("highest_deg", highest_deg, "lowest_deg", lowest_deg);
  at_least("max_range_m", max_range_m, "min_range_m", min_range_m);
  at_least("range_at_90_percent_m", range_at_90_percent_m, "range_at_10_percent_m", range_at_10_percent_m);
  if (!angles.empty() && std::ssize(angles) != beams) {
    offences.push_back({path + ".angles", std::format("{} entries", angles.size()),
                        std::format("none, or one for each of the {} beams", beams)});
  }
}

std::vector<Eigen::Vector3d> column_directions(const SpinningConfig& config) {
  std::vector<Eigen::Vector3d> directions;
  for (const BeamAngles& beam : config.angles) directions.push_back(direction(beam.elevation_deg, beam.azimuth_deg));
  if (!directions.empty()) return directions;
  const double step_deg = (config.highest_deg - config.lowest_deg) / (config.beams - 1);
  for (int i = 0; i < config.beams; ++i) directions.push_back(direction(config.lowest_deg + i * step_deg, 0.0));
  return directions;
}

double column_azimuth(const SpinningConfig& config, std::int64_t column) {
  // Of the column within its turn, so that a long drive loses no digits.
  const auto within = static_cast<double>(column % config.columns);
  return kDegree * config.start_deg - 2.0 * std::numbers::pi * within / config.columns;
}

double column_time_us(const SpinningConfig& config, std::int64_t column) {
  return static_cast<double>(column) * 1e6 / (config.rate_hz * config.columns);
}

}  // namespace ignis::sim
