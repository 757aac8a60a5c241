// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "common/config_fields.h"
#include "drivers/sim/imu_reading.h"

/// What a real inertial unit adds beyond white noise and walking biases. All off by default.
namespace ignis::sim {

/// Warming up: an offset that approaches its final value as 1 - exp(-t / time_s), in a random direction.
struct ImuDriftConfig {
  double gyro = 0.0;
  double accel = 0.0;
  double time_s = 300.0;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("gyro", self.gyro, {0.0, 1.0}, "rad/s", "length of the final gyro offset");
    visit.number("accel", self.accel, {0.0, 5.0}, "m/s^2", "length of the final accelerometer offset");
    visit.number("time_s", self.time_s, {1.0, 100000.0}, "s", "time constant");
  }
};

/// Imbalance of the two rotors: sinusoids along random directions with random phases. The line near 21 Hz in the
/// attitude of real units is twice their yaw rate; 180 Hz sampled at 250 Hz appears at 70 Hz.
struct ImuVibrationConfig {
  double mirror_hz = 180.0;
  double mirror_gyro = 0.0;
  double mirror_accel = 0.0;
  double head_hz = 20.2;
  double head_gyro = 0.0;
  double head_accel = 0.0;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("mirror_hz", self.mirror_hz, {0.1, 1000.0}, "Hz", "turns of the mirror");
    visit.number("mirror_gyro", self.mirror_gyro, {0.0, 10.0}, "rad/s", "amplitude that the mirror causes");
    visit.number("mirror_accel", self.mirror_accel, {0.0, 100.0}, "m/s^2", "amplitude that the mirror causes");
    visit.number("head_hz", self.head_hz, {0.1, 1000.0}, "Hz", "line of the head, twice its yaw rate");
    visit.number("head_gyro", self.head_gyro, {0.0, 10.0}, "rad/s", "amplitude that the head causes");
    visit.number("head_accel", self.head_accel, {0.0, 100.0}, "m/s^2", "amplitude that the head causes");
  }
};

/// A half sine of the given peak, such as a kerb.
struct ImuShock {
  double start_s = 0.0;
  double duration_s = 0.02;
  std::array<double, 3> gyro = {0.0, 0.0, 0.0};
  std::array<double, 3> accel = {0.0, 0.0, 0.0};

  void visit_fields(this auto& self, auto& visit) {
    visit.number("start_s", self.start_s, {0.0, 100000.0}, "s", "since the first sample");
    visit.number("duration_s", self.duration_s, {0.001, 10.0}, "s", "from begin to end");
    visit.vector("gyro", self.gyro, {-1000.0, 1000.0}, "rad/s", "peak, in the unit's axes");
    visit.vector("accel", self.accel, {-10000.0, 10000.0}, "m/s^2", "peak, in the unit's axes");
  }
};

/// Shocks at random times (exponential waiting times between them) along random directions.
struct RandomShockConfig {
  double rate_hz = 0.0;
  double duration_s = 0.02;
  double gyro = 1.0;
  double accel = 50.0;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("rate_hz", self.rate_hz, {0.0, 100.0}, "1/s", "mean number per second of quiet; 0: none");
    visit.number("duration_s", self.duration_s, {0.001, 10.0}, "s", "of each");
    visit.number("gyro", self.gyro, {0.0, 1000.0}, "rad/s", "length of the peak");
    visit.number("accel", self.accel, {0.0, 10000.0}, "m/s^2", "length of the peak");
  }
};

struct ImuDisturbanceConfig {
  ImuDriftConfig drift;
  ImuVibrationConfig vibration;
  std::vector<ImuShock> shocks;
  RandomShockConfig random_shocks;

  void visit_fields(this auto& self, auto& visit) {
    visit.section("drift", self.drift, "offset that grows while the unit warms up");
    visit.section("vibration", self.vibration, "imbalance of the rotors");
    visit.list("shocks", self.shocks, 10000, "shocks at given times");
    visit.section("random_shocks", self.random_shocks, "shocks at random times");
  }
};

/// Everything random comes from the seed, with a sequence of its own: switching one effect on changes no other.
class ImuDisturbance {
 public:
  ImuDisturbance(const ImuDisturbanceConfig& config, std::uint64_t seed);

  /// The offset of warming up at an instant [s].
  [[nodiscard]] ImuReading drift(double t) const;

  /// Vibration and shocks at an instant [s]; the instants never decrease.
  [[nodiscard]] ImuReading shaking(double t);

 private:
  /// A unit direction each for gyro and accelerometer.
  struct Directions {
    Eigen::Vector3d gyro;
    Eigen::Vector3d accel;
  };
  struct Line {
    double hz;
    ImuReading amplitude;
    double gyro_phase;
    double accel_phase;
  };

  [[nodiscard]] static Directions random_directions(std::mt19937_64& random);
  [[nodiscard]] static Line random_line(double hz, double gyro, double accel, std::mt19937_64& random);
  void draw_next_shock(double earliest);

  ImuDisturbanceConfig config_;
  std::mt19937_64 shock_random_;
  Directions drift_;
  std::vector<Line> lines_;
  ImuShock next_shock_;  ///< the random one that lasts or comes next
};

}  // namespace ignis::sim
