// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/extrinsics.h"
#include "drivers/packet_stream.h"
#include "drivers/scan_geometry.h"

/// How the sensor is mounted, from a few seconds at rest on level ground: gravity as the inertial unit feels it, and
/// the floor as the LiDAR sees it.
namespace ignis::l1 {

/// Mean and spread of inertial samples at rest, axes of the inertial unit.
struct RestingImu {
  std::int64_t samples = 0;
  Eigen::Vector3d mean_accel = Eigen::Vector3d::Zero();   ///< [m/s^2]
  Eigen::Vector3d sigma_accel = Eigen::Vector3d::Zero();  ///< [m/s^2] per sample
  Eigen::Vector3d mean_gyro = Eigen::Vector3d::Zero();    ///< [rad/s]
  Eigen::Vector3d sigma_gyro = Eigen::Vector3d::Zero();   ///< [rad/s] per sample
};
[[nodiscard]] RestingImu resting_imu(const std::vector<ImuAttitude>& samples);

/// Which way the sensor is tilted. Convention of Mount: pitch positive nose up, roll positive right side down.
struct Tilt {
  double pitch_deg = 0.0;
  double roll_deg = 0.0;
};

/// The pitch and roll that a mount must have for `up_sensor` (unit, sensor axes) to point up in the body frame. Axes
/// names and yaw are taken from `mount`, since neither gravity nor a floor tells them.
[[nodiscard]] Tilt tilt_from_up(const Eigen::Vector3d& up_sensor, const Mount& mount);

/// The dominant plane among points that lies below the sensor and faces up within `most_tilt_deg` of `up_hint`.
struct Floor {
  Eigen::Vector3d up_sensor = Eigen::Vector3d::UnitZ();  ///< unit normal, sensor axes, away from the ground
  double height_m = 0.0;                                 ///< of the sensor above it
  double roughness_m = 0.0;                              ///< root mean square distance of its points
  std::int64_t points = 0;
};
/// Largest consensus over seeded triples (RANSAC: Fischler and Bolles 1981), refined by least squares. Nothing when
/// fewer than 200 points agree within 5 cm.
[[nodiscard]] std::optional<Floor> find_floor(const std::vector<Eigen::Vector3d>& points_sensor,
                                              const Eigen::Vector3d& up_hint, double most_tilt_deg = 15.0);

/// What is suspicious about the samples, in words with figures; empty when nothing is.
[[nodiscard]] std::vector<std::string> suspicions(const RestingImu& imu, const Mount& mount);

}  // namespace ignis::l1
