// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <format>

#include "common/extrinsics.h"

namespace ignis {

/// A box of the vehicle's own structure, in the body frame: points inside are dropped.
struct OwnStructureBox {
  std::array<double, 3> min_m = {0.0, 0.0, 0.0};
  std::array<double, 3> max_m = {0.0, 0.0, 0.0};

  void visit_fields(this auto& self, auto& visit) {
    visit.vector("min_m", self.min_m, {-20.0, 20.0}, "m", "corner with the smallest coordinates, body frame");
    visit.vector("max_m", self.max_m, {-20.0, 20.0}, "m", "corner with the largest coordinates, body frame");
  }
  void check(config::Offences& offences, const std::string& path) const {
    for (std::size_t i = 0; i < 3; ++i) {
      if (min_m[i] < max_m[i]) continue;
      offences.push_back({std::format("{}.max_m[{}]", path, i), std::format("{}", max_m[i]),
                          std::format("more than min_m[{}] = {}", i, min_m[i])});
    }
  }
};

/// Section `driver` of the configuration.
struct DriverConfig {
  std::string port = "/dev/ttyUSB0";
  int baud = 2'000'000;
  std::string time_source = "arrival";
  double start_time_s = 0.0;
  double scan_latency_ms = 3.078;
  double imu_latency_ms = 0.3;
  double clock_window_s = 10.0;
  int packets_per_scan = 9;
  double range_min_m = 0.2;
  double range_max_m = 15.0;
  double range_scale = 0.001;
  double range_bias_m = 0.0;
  double yaw_bias_deg = -38.5;
  double z_bias_m = 0.0445;
  double gyro_limit_rad_s = 35.0;
  double accel_limit_m_s2 = 157.0;
  bool check_payload_size = true;
  std::vector<OwnStructureBox> own_structure;

  void visit_fields(this auto& self, auto& visit) {
    visit.text("port", self.port,
               "serial device or pty of the sensor, or udp://ADDRESS:PORT to listen on for its UDP board");
    visit.integer("baud", self.baud, {9600, 4'000'000}, "baud", "line speed, 8N1");
    visit.choice(
        "time_source", self.time_source, {"arrival", "counters"},
        "arrival: stamps fitted to the host clock; counters: from the sensor's counters alone, for captures and "
        "for simulations that do not run in real time");
    visit.number("start_time_s", self.start_time_s, {0.0, 1e10}, "s",
                 "stamp of scan counter 0 when time_source is counters");
    visit.number("scan_latency_ms", self.scan_latency_ms, {0.0, 20.0}, "ms",
                 "from the first point of a packet to the first byte of its AUX frame");
    visit.number("imu_latency_ms", self.imu_latency_ms, {0.0, 20.0}, "ms",
                 "from an inertial measurement to the first byte of its frame");
    visit.number("clock_window_s", self.clock_window_s, {1.0, 120.0}, "s", "memory of the clock fit");
    visit.integer("packets_per_scan", self.packets_per_scan, {1, 180}, "packets",
                  "mirror turns (180 a second) per scan");
    visit.number("range_min_m", self.range_min_m, {0.0, 10.0}, "m", "nearer points are dropped");
    visit.number("range_max_m", self.range_max_m, {0.1, 65.0}, "m", "farther points are dropped");
    visit.number("range_scale", self.range_scale, {0.0005, 0.002}, "m", "length of one count of range");
    visit.number("range_bias_m", self.range_bias_m, {-1.0, 1.0}, "m", "added to every range");
    visit.number("yaw_bias_deg", self.yaw_bias_deg, {-360.0, 360.0}, "deg", "added to the sensor's yaw angles");
    visit.number("z_bias_m", self.z_bias_m, {-1.0, 1.0}, "m", "optical centre above the mounting face");
    visit.number("gyro_limit_rad_s", self.gyro_limit_rad_s, {1.0, 100.0}, "rad/s", "full scale of the gyroscope");
    visit.number("accel_limit_m_s2", self.accel_limit_m_s2, {10.0, 1000.0}, "m/s^2", "full scale of the accelerometer");
    visit.flag("check_payload_size", self.check_payload_size,
               "refuse packets that announce another size than 240 and 120");
    visit.list("own_structure", self.own_structure, 32, "boxes around parts of the vehicle that the sensor sees");
  }
  void check(config::Offences& offences, const std::string& path) const;
};

/// The L1 tilted 45 degrees forward at the body origin; its inertial unit sits where the vendor's data sheet says.
[[nodiscard]] Extrinsics l1_extrinsics();

}  // namespace ignis
