// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "checkpoint_folder.h"
#include "frontend/lio.h"
#include "loss_watch.h"
#include "messages/keyframe_messages.h"
#include "messages/lio_command.h"
#include "messages/odometry_messages.h"
#include "messages/sensor_messages.h"
#include "runtime/channels.h"
#include "runtime/lcm_link.h"
#include "runtime/rate_limit.h"
#include "scan_backlog.h"
#include "sent_clouds.h"
#include "sent_keyframes.h"
#include "state_order.h"

namespace ignis {

/// Wires the odometry core to the bus. One thread; LCM's own receives meanwhile into the queues.
class FrontendNode {
 public:
  /// Goes on from the checkpoint in a folder, and keeps one there; empty: without. Throws runtime::UserError when the
  /// folder cannot be used.
  FrontendNode(const runtime::Application& application, const std::filesystem::path& checkpoint_folder);

  /// Handles what has arrived and reports health. Returns within about 100 ms.
  void spin_once();

 private:
  const char* on_imu(const imu_t& message);
  void on_scan_part(const messages::ScanPart& part);
  void on_scan(const messages::EncodedScan& scan, double scans_waiting);
  void on_request(const keyframe_request_t& request);
  void on_cloud_request(const keyframe_request_t& request);
  [[nodiscard]] std::optional<std::size_t> resend_keyframe(std::int32_t session, std::int32_t id);
  void publish_state(const NavState& state, std::int32_t session, const Matrix15d* covariance);
  void publish_scan(const ScanResult& scan, double milliseconds);
  void publish_cloud(const ScanResult& scan);
  void publish_keyframe(const Keyframe& keyframe);
  void publish(std::span<const ScanResult> scans, double milliseconds);
  void publish_health();
  void tell_silence(LioStatus& status) const;
  void tell_losses(LioStatus& status);
  void resume();
  void keep(std::span<const ScanResult> scans);
  void keep_end_of_session();

  runtime::IgnisConfig config_;
  std::string config_hash_;
  runtime::LcmLink link_;
  runtime::ReceiverCounts* imu_counts_ = nullptr;
  runtime::ReceiverCounts* scan_counts_ = nullptr;
  runtime::ReceiverCounts* request_counts_ = nullptr;
  runtime::ReceiverCounts* cloud_request_counts_ = nullptr;
  Lio lio_;
  messages::EncodedScanAssembler assembler_;
  ScanBacklog backlog_;
  std::int64_t scans_heard_ = 0;  // whole ones
  LossWatch imu_losses_{runtime::channels::kImu};
  LossWatch scan_losses_{runtime::channels::kScan};
  SentKeyframes sent_keyframes_{CheckpointFolder::kKeyframes};
  SentClouds sent_clouds_{10 * kMicrosPerSecond, 32'000'000};  // [us], [bytes]
  std::unique_ptr<CheckpointFolder> checkpoints_;
  std::int32_t kept_session_ = 0;        // of the checkpoint
  std::string told_note_;                // Lio::start_note() as it was last printed
  Utime last_checkpoint_ = 0;            // [us] scan time
  RateLimit resends_{100.0, 100.0};      // keyframes a second; back end and map together ask for at most 85
  RateLimit cloud_resends_{50.0, 50.0};  // answers a second; one map asks for 24 messages at a time
  Utime newest_utime_ = 0;
  std::chrono::steady_clock::time_point data_heard_ = std::chrono::steady_clock::now();
  StateOrder order_;
  std::int32_t state_sequence_ = 0;
  std::int32_t scan_sequence_ = 0;
  std::int32_t cloud_sequence_ = 0;
};

}  // namespace ignis
