// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/extrinsics.h"
#include "common/time.h"
#include "drivers/sim/scene_config.h"

namespace ignis::sim {

/// One frame as it goes over the wire. Times count from the start of the stream, which is also t = 0 of the drive.
struct StreamFrame {
  std::uint32_t message_id = 0;
  Utime send_utime = 0;      ///< [us] first byte on the wire, never before the end of the frame before
  Utime measured_utime = 0;  ///< [us] IMU: the sample. AUX, DISTANCE: point 0. Others: the sending
  std::vector<std::byte> bytes;
};

/// The byte stream of an L1 that is driven through a scene: VERSION once, TIME_SYNC requests each second, IMU at 250
/// Hz, AUX and DISTANCE at 180 Hz, in the order and at the pace of a 2 Mbaud line. Every point is cast from the pose at
/// its own instant. Values in, values out: the same scene, mount and seed give the same bytes; pacing is the caller's.
class L1Stream {
 public:
  /// Ends after `max_duration_s` or with the drive. Throws config::ConfigError for an impossible drive.
  L1Stream(const SceneConfig& scene, const Extrinsics& extrinsics, std::uint64_t seed,
           std::optional<double> max_duration_s = std::nullopt);

  /// The next frame, or nothing after the end.
  [[nodiscard]] std::optional<StreamFrame> next_frame();

  /// True motion at an instant of the stream [us].
  [[nodiscard]] Motion truth_at(Utime utime) const;

  [[nodiscard]] double duration() const { return duration_; }  ///< [s]
  [[nodiscard]] const Trajectory& trajectory() const { return trajectory_; }

 private:
  enum Source : std::size_t { kScan, kImu, kTimeSync, kVersion, kSourceCount };

  [[nodiscard]] StreamFrame send(std::uint32_t id, const l1::Payload& payload, double ready_us, double measured_us);
  [[nodiscard]] StreamFrame send_auxiliary();
  [[nodiscard]] StreamFrame send_distance();
  [[nodiscard]] StreamFrame send_imu();
  [[nodiscard]] StreamFrame send_time_sync();
  [[nodiscard]] StreamFrame send_version();
  [[nodiscard]] l1::Auxiliary packet_angles() const;
  void cast_scan(l1::Auxiliary& packet);
  void cast_point(l1::Auxiliary& packet, std::size_t j);
  void schedule(Source source, double measured_us, double ready_us);

  L1BeamConfig lidar_;
  RayScene scene_;
  Trajectory trajectory_;
  Pose T_body_lidar_;
  Pose T_body_imu_;
  double duration_;
  ImuModel imu_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;

  std::array<double, kSourceCount> measured_us_{};
  std::array<double, kSourceCount> ready_us_{};  ///< infinite: the source has ended
  double wire_free_us_ = 0.0;
  std::uint8_t frame_sequence_ = 0;
  std::int64_t scan_count_ = 0;
  std::int64_t imu_count_ = 0;
  std::uint32_t sync_count_ = 0;
  std::optional<l1::Distance> pending_distance_;
};

}  // namespace ignis::sim
