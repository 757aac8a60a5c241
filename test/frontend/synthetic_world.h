// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "common/measurements.h"
#include "common/pose.h"

/// A small world to drive in: axis-aligned boxes and upright pillars, an exact trajectory, and sensors with noise that
/// are sampled from both. World and body axes as in the project; the trajectory starts at the origin with yaw 0.
namespace ignis::test {

struct Box {
  Eigen::Vector3d lo;
  Eigen::Vector3d hi;
};

struct Pillar {
  double x;
  double z;
  double radius;
};

/// A box on its way.
struct Mover {
  Box at_start;
  Eigen::Vector3d velocity;  ///< [m/s]
  double start_s = 0.0;      ///< stands until then

  [[nodiscard]] Box at(double seconds) const;
};

struct World {
  Box room;  ///< seen from inside
  std::vector<Box> boxes;
  std::vector<Pillar> pillars;
  std::vector<Mover> movers = {};
  std::vector<Pillar> drums = {};  ///< seen from inside

  /// Distance to the first surface along a unit direction at an instant [s], or a negative number.
  [[nodiscard]] double cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double seconds) const;
};

/// True pose at a time [s].
using Trajectory = std::function<Pose(double)>;

/// Stands for `rest_s`, then drives an ellipse to the left with half axes `a` (sideways) and `b` (ahead) at about
/// `speed`, with a little pitch, roll and heave.
[[nodiscard]] Trajectory ellipse_drive(double rest_s, double a, double b, double speed);

/// Constant velocity straight ahead from t = 0, with optional standing time before a smooth start.
[[nodiscard]] Trajectory straight_drive(double rest_s, double speed);

struct Sensors {
  double imu_hz = 250.0;
  double gyro_density = 0.003;  ///< [rad/s/sqrt(Hz)]
  double accel_density = 0.06;  ///< [m/s^2/sqrt(Hz)]
  Eigen::Vector3d gyro_bias = Eigen::Vector3d(0.01, -0.008, 0.006);
  Eigen::Vector3d accel_bias = Eigen::Vector3d(0.1, -0.05, 0.08);
  double scan_hz = 20.0;
  double range_sigma = 0.012;  ///< [m]
  double range_grid = 0.008;   ///< [m]
  double max_range = 15.0;
  bool car = false;  ///< horizontal rings instead of the L1's tilted rotating mirror
};

struct Drive {
  std::vector<ImuSample> imu;
  std::vector<Scan> scans;
  Trajectory truth;
};

[[nodiscard]] Drive simulate(const World& world, const Trajectory& truth, double seconds, const Sensors& sensors,
                             std::uint32_t seed);

/// A furnished hall of 26 x 18 x 4.5 m around an ellipse drive with half axes 6 and 4.
[[nodiscard]] World furnished_hall();
/// A bare corridor along Z, 3 m wide, without ends in sight.
[[nodiscard]] World bare_corridor();
/// The same bent about an upright axis `radius_m` to the left of its middle.
[[nodiscard]] World bent_corridor(double radius_m);
/// Bays of kBay along a hall of 8 m x 3.6 m whose ends are out of sight.
[[nodiscard]] World bays();
inline constexpr double kBay = 1.5;  // m
/// A street with facades, parked cars and poles, 200 m long.
[[nodiscard]] World street();

}  // namespace ignis::test
