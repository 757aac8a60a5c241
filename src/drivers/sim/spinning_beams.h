// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "common/config_fields.h"

/// Optics of a spinning LiDAR: a column of beams that fire together while the head turns. Sensor frame: X forward, Y
/// left, Z up, all beams from the origin.
namespace ignis::sim {

/// One beam of a sensor whose beams are not evenly spaced.
struct BeamAngles {
  double elevation_deg = 0.0;
  double azimuth_deg = 0.0;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("elevation_deg", self.elevation_deg, {-90.0, 90.0}, "deg", "above the horizon");
    visit.number("azimuth_deg", self.azimuth_deg, {-30.0, 30.0}, "deg", "to the left of the column's own direction");
  }
};

struct SpinningConfig {
  int beams = 64;
  double lowest_deg = -22.5;
  double highest_deg = 22.5;
  std::vector<BeamAngles> angles = {};
  double rate_hz = 10.0;
  int columns = 1024;
  double start_deg = 180.0;
  double range_noise_m = 0.02;
  double invalid_fraction = 0.0;
  double min_range_m = 0.5;
  double max_range_m = 100.0;
  double range_at_10_percent_m = 45.0;
  double range_at_90_percent_m = 100.0;
  double imu_rate_hz = 200.0;

  void visit_fields(this auto& self, auto& visit) {
    visit.integer("beams", self.beams, {16, 128}, "beams", "in a column");
    visit.number("lowest_deg", self.lowest_deg, {-90.0, 90.0}, "deg", "elevation of the lowest beam");
    visit.number("highest_deg", self.highest_deg, {-90.0, 90.0}, "deg",
                 "elevation of the highest beam; the others lie evenly between");
    visit.list("angles", self.angles, 128, "each beam by itself, instead of lowest_deg and highest_deg");
    visit.number("rate_hz", self.rate_hz, {1.0, 50.0}, "Hz", "turns, each of which is one scan");
    visit.integer("columns", self.columns, {90, 4096}, "columns", "per turn, evenly in time and angle");
    visit.number("start_deg", self.start_deg, {-360.0, 360.0}, "deg",
                 "direction of the first column, to the left of forward; the head turns to the right");
    visit.number("range_noise_m", self.range_noise_m, {0.0, 1.0}, "m", "standard deviation of a range");
    visit.number("invalid_fraction", self.invalid_fraction, {0.0, 1.0}, "1", "points lost at random");
    visit.number("min_range_m", self.min_range_m, {0.0, 10.0}, "m", "nearer surfaces give no return");
    visit.number("max_range_m", self.max_range_m, {1.0, 500.0}, "m", "farther surfaces give no return");
    visit.number("range_at_10_percent_m", self.range_at_10_percent_m, {0.1, 500.0}, "m", "farthest dark target, faced");
    visit.number("range_at_90_percent_m", self.range_at_90_percent_m, {0.1, 500.0}, "m",
                 "farthest bright target, faced");
    visit.number("imu_rate_hz", self.imu_rate_hz, {50.0, 1000.0}, "Hz", "samples of the inertial unit beside it");
  }
  void check(config::Offences& offences, const std::string& path) const;
};

/// Unit directions of all beams of a column that looks forward, lowest first or in the order of `angles`.
[[nodiscard]] std::vector<Eigen::Vector3d> column_directions(const SpinningConfig& config);

/// Direction [rad] of a column, to the left of forward. Columns count on from turn to turn.
[[nodiscard]] double column_azimuth(const SpinningConfig& config, std::int64_t column);

/// Instant [us] of a column since the first.
[[nodiscard]] double column_time_us(const SpinningConfig& config, std::int64_t column);

}  // namespace ignis::sim
