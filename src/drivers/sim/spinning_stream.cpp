// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/spinning_stream.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/config_check.h"
#include "drivers/sim/surface_return.h"

namespace ignis::sim {
namespace {

constexpr std::uint64_t kLidarSeedOffset = 0x9E3779B97F4A7C15ULL;
/// A reading is at the limit: it was clipped there, so equality is exact up to the rotation that undoes the mount.
constexpr double kLimitShare = 1.0 - 1e-9;

const SpinningConfig& checked(const LidarConfig& lidar) {
  if (!lidar.is_spinning()) {
    throw config::ConfigError(config::Offences{{"lidar.model", '"' + lidar.model + '"', "\"spinning\""}});
  }
  config::require_valid(lidar, "lidar");
  return lidar.spinning;
}

bool at_limit(const Eigen::Vector3d& reading, double limit) {
  return limit > 0.0 && reading.cwiseAbs().maxCoeff() >= limit * kLimitShare;
}

}  // namespace

SpinningStream::SpinningStream(const SceneConfig& scene, const Extrinsics& extrinsics, std::uint64_t seed,
                               std::optional<double> max_duration_s)
    : lidar_(checked(scene.lidar)),
      imu_config_(scene.imu),
      scene_(make_ray_scene(scene)),
      trajectory_(scene.trajectory),
      T_body_lidar_(extrinsics.lidar.T_body_sensor()),
      mount_(extrinsics, {}),
      directions_(column_directions(lidar_)),
      duration_(std::min(trajectory_.duration(), max_duration_s.value_or(std::numeric_limits<double>::infinity()))),
      imu_(scene.imu, extrinsics.imu.T_body_sensor(), 1.0 / lidar_.imu_rate_hz, seed),
      random_(seed ^ kLidarSeedOffset) {}

std::optional<SpinningStream::Event> SpinningStream::next() {
  const double end_us = duration_ * 1e6;
  // At the same instant the inertial sample goes first, so that it is there when the scan's end is looked up.
  const double earliest_us = std::min(imu_time_us(), turn_end_us());
  if (earliest_us > end_us) return std::nullopt;
  if (imu_time_us() == earliest_us) return measure_imu();
  return cast_turn();
}

Motion SpinningStream::truth_at(Utime utime) const { return trajectory_.at(static_cast<double>(utime) * 1e-6); }

double SpinningStream::imu_time_us() const { return static_cast<double>(imu_count_) * 1e6 / lidar_.imu_rate_hz; }

double SpinningStream::turn_end_us() const {
  return column_time_us(lidar_, (static_cast<std::int64_t>(turn_) + 1) * lidar_.columns);
}

ImuSample SpinningStream::measure_imu() {
  const double time_us = imu_time_us();
  const ImuReading reading = imu_.sample(trajectory_.at(time_us * 1e-6));
  ImuSample sample = mount_.to_body(reading.gyro, reading.accel);
  sample.utime = std::llround(time_us);
  sample.sequence = imu_count_++;
  sample.saturated = at_limit(reading.gyro, imu_config_.gyro_limit) || at_limit(reading.accel, imu_config_.accel_limit);
  return sample;
}

Scan SpinningStream::cast_turn() {
  const std::int64_t first_column = static_cast<std::int64_t>(turn_) * lidar_.columns;
  Scan scan;
  scan.utime = std::llround(column_time_us(lidar_, first_column));
  scan.sequence = turn_++;
  scan.points.reserve(directions_.size() * static_cast<std::size_t>(lidar_.columns));
  for (std::int64_t column = first_column; column < first_column + lidar_.columns; ++column) {
    const Utime instant = std::llround(column_time_us(lidar_, column));
    cast_column(column, static_cast<std::int32_t>(instant - scan.utime), scan.points);
  }
  if (scan.points.empty()) return scan;
  const std::int32_t first_us = scan.points.front().dt_us;
  for (ScanPoint& point : scan.points) point.dt_us -= first_us;
  scan.utime += first_us;
  scan.duration_us = scan.points.back().dt_us;
  return scan;
}

void SpinningStream::cast_column(std::int64_t column, std::int32_t dt_us, std::vector<ScanPoint>& points) {
  const double t = column_time_us(lidar_, column) * 1e-6;
  const Pose T_world_lidar = trajectory_.at(t).T_world_body * T_body_lidar_;
  const Eigen::AngleAxisd turned(column_azimuth(lidar_, column), Eigen::Vector3d::UnitZ());
  const Eigen::Matrix3d R_lidar_column = turned.toRotationMatrix();
  const Eigen::Matrix3d R_world_column = T_world_lidar.rotation.toRotationMatrix() * R_lidar_column;
  const Eigen::Matrix3d R_body_column = T_body_lidar_.rotation.toRotationMatrix() * R_lidar_column;
  for (const Eigen::Vector3d& direction : directions_) {
    float intensity = 0.0F;
    const Ray ray_world{T_world_lidar.translation, (R_world_column * direction).normalized()};
    const std::optional<double> range = measured_range(ray_world, t, intensity);
    if (!range) continue;
    const Eigen::Vector3d p_body = T_body_lidar_.translation + *range * (R_body_column * direction);
    points.push_back({.position = p_body.cast<float>(), .intensity = intensity, .dt_us = dt_us});
  }
}

std::optional<double> SpinningStream::measured_range(const Ray& ray_world, double t, float& intensity) {
  // Drawn for every point, hit or not, so that a change of the scene does not shift the noise of other points.
  const double noise = lidar_.range_noise_m * normal_(random_);
  const bool lost = uniform_(random_) < lidar_.invalid_fraction;

  const std::optional<Hit> hit = scene_.cast(ray_world, lidar_.max_range_m, t);
  if (!hit || lost || hit->distance < lidar_.min_range_m) return std::nullopt;
  const double brightness = hit->reflectivity * std::abs(hit->normal.dot(ray_world.direction));
  if (hit->distance > visible_range(lidar_.range_at_10_percent_m, lidar_.range_at_90_percent_m, brightness)) {
    return std::nullopt;
  }
  intensity = grey_value(brightness);
  return hit->distance + noise;
}

}  // namespace ignis::sim
