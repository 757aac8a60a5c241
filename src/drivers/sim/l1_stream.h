// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "common/extrinsics.h"
#include "common/time.h"
#include "drivers/sim/device_config.h"
#include "drivers/sim/host_listener.h"
#include "drivers/sim/scene_config.h"

namespace ignis::sim {

/// One frame as it goes over the wire. Times count from the start of the stream, which is also t = 0 of the drive.
struct StreamFrame {
  std::uint32_t message_id = 0;
  Utime send_utime = 0;      ///< [us] first byte on the wire, never before the end of the frame before
  Utime measured_utime = 0;  ///< [us] IMU: the sample. AUX, DISTANCE: point 0. Others: the sending
  std::vector<std::byte> bytes;

  /// [us] last byte on the wire: before it no host can have the frame.
  [[nodiscard]] Utime end_utime() const;
};

/// The byte stream of an L1 that is driven through a scene: VERSION once, TIME_SYNC requests each second, IMU at 250
/// Hz, AUX and DISTANCE at 180 Hz, in the order and at the pace of a 2 Mbaud line. Every point is cast from the pose at
/// its own instant. It obeys what a host asks for. Values in, values out: the same scene, mount, seed and commands give
/// the same bytes; pacing is the caller's.
class L1Stream {
 public:
  /// Ends after `max_duration_s` or with the drive. Throws config::ConfigError for an impossible drive or device, and
  /// for a scene whose LiDAR is not an L1.
  L1Stream(const SceneConfig& scene, const Extrinsics& extrinsics, std::uint64_t seed,
           std::optional<double> max_duration_s = std::nullopt, const DeviceConfig& device = {});

  /// The next frame, or nothing after the end.
  [[nodiscard]] std::optional<StreamFrame> next_frame();

  /// What the host asks for, at an instant of the stream [us]. Shows in frames that next_frame() has not yet given.
  /// Standby: a scan whose AUX is out is finished, then inertial and time-sync frames alone go on. Back in normal mode
  /// the scans start over after the spin-up, with the ids that follow.
  void obey(const HostCommand& command, Utime now);

  [[nodiscard]] l1::WorkingMode mode() const { return mode_; }

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
  void schedule_first_frames();
  void schedule_scan();
  void restart_scans(double first_us);
  [[nodiscard]] bool power_fails_first() const;
  void power_up_again();
  void obey_one(const VersionQuery& query, double now_us);
  void obey_one(const SyncQuery& query, double now_us);
  void obey_one(const SyncAnswer& answer, double now_us);
  void obey_one(const ModeCommand& command, double now_us);
  void obey_one(const LedCommand& command, double now_us);
  [[nodiscard]] std::uint16_t wire_id(std::int64_t count) const;

  L1BeamConfig lidar_;
  DeviceConfig device_;
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
  double power_fails_us_;        ///< infinite: it has failed, or never will
  double powered_up_us_ = 0.0;   ///< sensor time and inertial ids count from here
  double first_scan_us_ = 0.0;   ///< the mirror has turned evenly since this scan
  std::int64_t first_scan_ = 0;  ///< its count
  std::uint8_t frame_sequence_ = 0;
  std::int64_t scan_count_ = 0;   ///< since power-up
  std::int64_t imu_count_ = 0;    ///< since power-up
  std::uint32_t sync_count_ = 0;  ///< since power-up
  std::optional<l1::Distance> pending_distance_;

  l1::WorkingMode mode_ = l1::WorkingMode::kNormal;
  std::uint8_t work_status_ = 0;
  std::uint32_t sync_delay_us_;
  double sync_sent_us_ = 0.0;  ///< of the latest request
};

}  // namespace ignis::sim
