// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <random>
#include <variant>
#include <vector>

#include "common/extrinsics.h"
#include "common/measurements.h"
#include "drivers/body_mount.h"
#include "drivers/sim/scene_config.h"

namespace ignis::sim {

/// What a spinning LiDAR and the inertial unit beside it measure on a drive through a scene, as its driver would
/// publish it: body frame, one scan per turn, not deskewed. Every column is cast from the pose at its own instant.
/// Times count from the start of the stream, which is also t = 0 of the drive. Values in, values out: the same scene,
/// mounts and seed give the same measurements.
class SpinningStream {
 public:
  using Event = std::variant<ImuSample, Scan>;

  /// Ends after `max_duration_s` or with the drive. Throws config::ConfigError for an impossible drive, and for a scene
  /// whose LiDAR does not spin.
  SpinningStream(const SceneConfig& scene, const Extrinsics& extrinsics, std::uint64_t seed,
                 std::optional<double> max_duration_s = std::nullopt);

  /// The next measurement in the order of completion, or nothing after the end. A scan comes when its turn is over; a
  /// turn that the drive does not finish is not given.
  [[nodiscard]] std::optional<Event> next();

  /// True motion at an instant of the stream [us].
  [[nodiscard]] Motion truth_at(Utime utime) const;

  [[nodiscard]] double duration() const { return duration_; }  ///< [s]

 private:
  [[nodiscard]] ImuSample measure_imu();
  [[nodiscard]] Scan cast_turn();
  void cast_column(std::int64_t column, std::int32_t dt_us, std::vector<ScanPoint>& points);
  [[nodiscard]] std::optional<double> measured_range(const Ray& ray_world, double t, float& intensity);
  [[nodiscard]] double imu_time_us() const;
  [[nodiscard]] double turn_end_us() const;

  SpinningConfig lidar_;
  ImuModelConfig imu_config_;
  RayScene scene_;
  Trajectory trajectory_;
  Pose T_body_lidar_;
  l1::BodyMount mount_;
  std::vector<Eigen::Vector3d> directions_;
  double duration_;
  ImuModel imu_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
  std::int32_t turn_ = 0;
  std::int32_t imu_count_ = 0;
};

}  // namespace ignis::sim
