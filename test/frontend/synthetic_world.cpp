// SPDX-License-Identifier: Apache-2.0
#include "frontend/synthetic_world.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "common/frames.h"
#include "common/so3.h"

namespace ignis::test {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr Utime kEpoch = 1'700'000'000'000'000;

/// Entry and exit of a ray through a box; entry > exit when it misses.
std::pair<double, double> slab(const Box& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  double entry = -kFar;
  double exit = kFar;
  for (int i = 0; i < 3; ++i) {
    const double inverse = 1.0 / direction[i];
    const double near = (box.lo[i] - origin[i]) * inverse;
    const double far = (box.hi[i] - origin[i]) * inverse;
    entry = std::max(entry, std::min(near, far));
    exit = std::min(exit, std::max(near, far));
  }
  return {entry, exit};
}

/// Where a ray meets an upright cylinder: on its way in, or on its way out. Negative when it does not.
double pillar_distance(const Pillar& pillar, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                       bool from_inside) {
  const double dx = origin.x() - pillar.x;
  const double dz = origin.z() - pillar.z;
  const double a = direction.x() * direction.x() + direction.z() * direction.z();
  const double b = dx * direction.x() + dz * direction.z();
  const double c = dx * dx + dz * dz - pillar.radius * pillar.radius;
  const double discriminant = b * b - a * c;
  if (discriminant < 0.0 || a < 1e-12) return -1.0;
  const double half = std::sqrt(discriminant);
  return (-b + (from_inside ? half : -half)) / a;
}

/// Distance driven at time t after the start: the speed rises smoothly over two seconds.
double driven(double t, double speed) {
  constexpr double kRise = 2.0;
  if (t <= 0.0) return 0.0;
  if (t >= kRise) return speed * (t - 0.5 * kRise);
  const double u = t / kRise;
  return speed * kRise * (u * u * u - 0.5 * u * u * u * u);  // integral of 3u^2 - 2u^3
}

struct Beam {
  double dt;  ///< [s] after the scan's start
  Eigen::Vector3d direction;
};

/// 120 points per mirror turn over a half circle, 180 turns a second, the mirror's plane turning at 10.1 Hz about an
/// axis that is tilted 45 degrees forward.
std::vector<Beam> l1_beams(double scan_start, double duration) {
  const Eigen::Quaterniond q_body_sensor = so3::exp(Eigen::Vector3d(-kPi / 4.0, 0.0, 0.0));
  std::vector<Beam> beams;
  for (int k = 0; k < static_cast<int>(std::lround(duration * 21600.0)); ++k) {
    const double dt = (k / 120) / 180.0 + (k % 120) / 43200.0;
    const double mirror = kPi * (k % 120 + 0.5) / 120.0;
    const double rotor = 2.0 * kPi * 10.1 * (scan_start + dt);
    const Eigen::Vector3d sensor(std::cos(mirror) * std::cos(rotor), std::sin(mirror),
                                 std::cos(mirror) * std::sin(rotor));
    beams.push_back({dt, q_body_sensor * sensor});
  }
  return beams;
}

/// 32 rings from -24 to +7 degrees, 180 azimuths, one turn.
std::vector<Beam> car_beams(double duration) {
  std::vector<Beam> beams;
  for (int azimuth = 0; azimuth < 180; ++azimuth) {
    for (int ring = 0; ring < 32; ++ring) {
      const double elevation = (-24.0 + ring) * kPi / 180.0;
      const double angle = kPi - 2.0 * kPi * azimuth / 180.0;
      beams.push_back(
          {duration * azimuth / 180.0,
           {std::cos(elevation) * std::sin(angle), std::sin(elevation), -std::cos(elevation) * std::cos(angle)}});
    }
  }
  return beams;
}

class Sampler {
 public:
  Sampler(const World& world, Trajectory truth, const Sensors& sensors, std::uint32_t seed)
      : world_(world), truth_(std::move(truth)), sensors_(sensors), random_(seed) {}

  ImuSample imu(int index) {
    const double t = index / sensors_.imu_hz;
    constexpr double kStep = 1e-3;
    const Pose before = truth_(t - kStep);
    const Pose now = truth_(t);
    const Pose after = truth_(t + kStep);
    const Eigen::Vector3d acceleration =
        (after.translation - 2.0 * now.translation + before.translation) / (kStep * kStep);
    ImuSample sample;
    sample.utime = kEpoch + to_micros(t);
    sample.sequence = index;
    sample.gyro = so3::log(before.rotation.conjugate() * after.rotation) / (2.0 * kStep) + sensors_.gyro_bias +
                  noise(sensors_.gyro_density * std::sqrt(sensors_.imu_hz));
    sample.accel = now.rotation.conjugate() * (acceleration + 9.81 * frames::up()) + sensors_.accel_bias +
                   noise(sensors_.accel_density * std::sqrt(sensors_.imu_hz));
    return sample;
  }

  Scan scan(int index) {
    const double duration = 1.0 / sensors_.scan_hz;
    const double start = index * duration;
    Scan scan;
    scan.utime = kEpoch + to_micros(start);
    scan.sequence = index;
    scan.duration_us = static_cast<std::int32_t>(to_micros(duration));
    for (const Beam& beam : sensors_.car ? car_beams(duration) : l1_beams(start, duration)) {
      const Pose pose = truth_(start + beam.dt);
      const double range = world_.cast(pose.translation, pose.rotation * beam.direction, start + beam.dt);
      if (range <= 0.0 || range > sensors_.max_range) continue;
      const double noisy = range + sensors_.range_sigma * normal_(random_);
      const double measured = std::round(noisy / sensors_.range_grid) * sensors_.range_grid;
      scan.points.push_back(
          {(measured * beam.direction).cast<float>(), 100.0F, static_cast<std::int32_t>(to_micros(beam.dt))});
    }
    return scan;
  }

 private:
  Eigen::Vector3d noise(double sigma) {
    const double x = normal_(random_);
    const double y = normal_(random_);
    const double z = normal_(random_);
    return sigma * Eigen::Vector3d(x, y, z);
  }

  const World& world_;
  Trajectory truth_;
  Sensors sensors_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace

Box Mover::at(double seconds) const {
  const Eigen::Vector3d shift = std::max(seconds - start_s, 0.0) * velocity;
  return {at_start.lo + shift, at_start.hi + shift};
}

double World::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double seconds) const {
  double best = slab(room, origin, direction).second;
  const auto meet = [&](const Box& box) {
    const auto [entry, exit] = slab(box, origin, direction);
    if (entry <= exit && entry > 0.0) best = std::min(best, entry);
  };
  for (const Box& box : boxes) meet(box);
  for (const Mover& mover : movers) meet(mover.at(seconds));
  const auto meet_round = [&](const Pillar& pillar, bool from_inside) {
    const double distance = pillar_distance(pillar, origin, direction, from_inside);
    if (distance > 0.0) best = std::min(best, distance);
  };
  for (const Pillar& pillar : pillars) meet_round(pillar, false);
  for (const Pillar& drum : drums) meet_round(drum, true);
  return best;
}

Trajectory ellipse_drive(double rest_s, double a, double b, double speed) {
  return [=](double t) {
    const double angle = driven(t - rest_s, speed) / std::sqrt(0.5 * (a * a + b * b));
    const double sway = 0.02 * (1.0 - std::cos(angle * 0.5));
    frames::YawPitchRoll attitude;
    attitude.yaw = std::atan2(a * std::sin(angle), b * std::cos(angle));
    attitude.pitch = sway * std::sin(7.0 * angle);
    attitude.roll = sway * std::sin(5.0 * angle);
    return Pose{frames::from_yaw_pitch_roll(attitude),
                {-a * (1.0 - std::cos(angle)), sway * std::sin(6.0 * angle), -b * std::sin(angle)}};
  };
}

Trajectory straight_drive(double rest_s, double speed) {
  return [=](double t) {
    const double distance = rest_s > 0.0 ? driven(t - rest_s, speed) : speed * t;
    return Pose{Eigen::Quaterniond::Identity(), {0.0, 0.0, -distance}};
  };
}

Drive simulate(const World& world, const Trajectory& truth, double seconds, const Sensors& sensors,
               std::uint32_t seed) {
  Sampler sampler(world, truth, sensors, seed);
  Drive drive;
  drive.truth = [truth](double t) { return truth(t); };
  const auto imu_count = static_cast<int>(seconds * sensors.imu_hz) + 1;
  const auto scan_count = static_cast<int>(seconds * sensors.scan_hz);
  for (int i = 0; i < imu_count; ++i) drive.imu.push_back(sampler.imu(i));
  for (int i = 0; i < scan_count; ++i) drive.scans.push_back(sampler.scan(i));
  return drive;
}

World furnished_hall() {
  World world;
  world.room = {{-19.0, -0.6, -9.0}, {7.0, 3.9, 9.0}};
  world.boxes = {{{-9.0, -0.6, -1.2}, {-3.0, 1.6, 1.2}},  {{-17.5, -0.6, -8.5}, {-14.5, 2.0, -6.5}},
                 {{3.5, -0.6, 2.0}, {5.0, 1.2, 6.0}},     {{-16.0, -0.6, 6.5}, {-11.0, 2.4, 8.0}},
                 {{2.5, -0.6, -7.5}, {4.0, 2.8, -6.0}},   {{-1.0, -0.6, 7.0}, {1.5, 1.0, 8.5}},
                 {{-18.5, -0.6, -1.0}, {-17.0, 1.8, 2.0}}};
  world.pillars = {{2.0, -5.0, 0.35}, {-6.0, 5.5, 0.3}, {-14.0, -3.0, 0.35}, {-6.0, -6.5, 0.3}};
  return world;
}

World bare_corridor() { return {{{-1.5, -0.6, -500.0}, {1.5, 2.2, 500.0}}, {}, {}}; }

World bent_corridor(double radius_m) {
  World world = bare_corridor();
  world.room.lo.x() = -500.0;
  world.room.hi.x() = 500.0;
  world.pillars = {{-radius_m, 0.0, radius_m - 1.5}};
  world.drums = {{-radius_m, 0.0, radius_m + 1.5}};
  return world;
}

World bays() {
  World world;
  world.room = {{-4.0, -0.6, -200.0}, {4.0, 3.0, 200.0}};
  for (int bay = -100; bay <= 100; ++bay) {
    const double z = kBay * (bay + 0.5);
    world.boxes.push_back({{-4.0, -0.6, z - 0.15}, {-2.5, 3.0, z + 0.15}});
    world.boxes.push_back({{2.5, -0.6, z - 0.15}, {4.0, 3.0, z + 0.15}});
  }
  return world;
}

World street() {
  World world;
  world.room = {{-12.0, -1.7, -320.0}, {14.0, 60.0, 120.0}};
  for (int i = -6; i < 20; ++i) {
    const double z = -12.0 * i;
    world.boxes.push_back({{-12.0, -1.7, z}, {-9.0 - 0.4 * (i % 3), 8.0, z + 7.0}});
    world.boxes.push_back({{10.0 + 0.5 * (i % 2), -1.7, z + 3.0}, {14.0, 9.0, z + 9.0}});
    world.boxes.push_back({{4.0, -1.7, z}, {5.8, -0.2, z + 4.2}});
    world.pillars.push_back({-5.0, z + 5.0, 0.15});
  }
  return world;
}

}  // namespace ignis::test
