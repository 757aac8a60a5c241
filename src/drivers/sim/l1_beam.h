// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/config_fields.h"
#include "drivers/l1_messages.h"
#include "drivers/sim/solids.h"

/// Optics of the simulated L1: where each beam goes, how far it sees, what it reports. Sensor frame: X opposite to the
/// cable, Y left, Z up, origin in the bottom face. Geometry: the vendor's formula, solved for the ray.
namespace ignis::sim {

struct L1BeamConfig {
  double yaw_rate_hz = 10.1;
  double yaw_start_deg = 124.5;
  double yaw_error_deg = 0.0;
  double b_axis_mm = 6.6;
  double theta_rad = 0.0;
  double ksi_rad = 0.03;
  double range_noise_m = 0.012;
  double range_grid_mm = 8.13;
  double invalid_fraction = 0.01;
  double min_range_m = 0.05;
  double range_at_10_percent_m = 10.0;
  double range_at_90_percent_m = 20.0;
  bool trim_payloads = true;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("yaw_rate_hz", self.yaw_rate_hz, {1.0, 20.0}, "Hz", "turns of the head");
    visit.number("yaw_start_deg", self.yaw_start_deg, {0.0, 360.0}, "deg", "reported yaw at the start");
    visit.number("yaw_error_deg", self.yaw_error_deg, {0.0, 5.0}, "deg",
                 "white error of the reported yaw of each packet");
    visit.number("b_axis_mm", self.b_axis_mm, {-50.0, 50.0}, "mm", "beam origin off the axis");
    visit.number("theta_rad", self.theta_rad, {-0.2, 0.2}, "rad", "first calibration angle");
    visit.number("ksi_rad", self.ksi_rad, {-0.2, 0.2}, "rad", "second calibration angle");
    visit.number("range_noise_m", self.range_noise_m, {0.0, 1.0}, "m", "standard deviation of a range");
    visit.number("range_grid_mm", self.range_grid_mm, {1.0, 100.0}, "mm", "step of the time-to-digital converter");
    visit.number("invalid_fraction", self.invalid_fraction, {0.0, 1.0}, "1", "points lost at random");
    visit.number("min_range_m", self.min_range_m, {0.0, 5.0}, "m", "nearer surfaces give no return");
    visit.number("range_at_10_percent_m", self.range_at_10_percent_m, {0.1, 50.0}, "m", "farthest dark target, faced");
    visit.number("range_at_90_percent_m", self.range_at_90_percent_m, {0.1, 50.0}, "m",
                 "farthest bright target, faced");
    visit.flag("trim_payloads", self.trim_payloads, "leave out trailing zeros of payloads, as MAVLink 2 does");
  }
  void check(config::Offences& offences, const std::string& path) const;
};

/// Ray of point j of a packet in the sensor frame [m]; the slant range counts from the ray's origin.
[[nodiscard]] Ray beam(const l1::Auxiliary& packet, std::size_t j);

/// A measured range as the wire carries it [mm]: on the converter's grid, 0 when it cannot be expressed.
[[nodiscard]] std::uint16_t range_on_grid(const L1BeamConfig& config, double range_m);

}  // namespace ignis::sim
