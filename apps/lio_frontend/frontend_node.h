// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>

#include "frontend/lio.h"
#include "messages/keyframe_messages.h"
#include "messages/odometry_messages.h"
#include "messages/sensor_messages.h"
#include "runtime/lcm_link.h"
#include "runtime/rate_limit.h"

namespace ignis {

/// Wires the odometry core to the bus. One thread; LCM's own receives meanwhile into the queues.
class FrontendNode {
 public:
  explicit FrontendNode(const runtime::Application& application);

  /// Handles what has arrived and reports health. Returns within about 100 ms.
  void spin_once();

 private:
  void on_imu(const imu_t& message);
  void on_scan_part(const scan_t& part);
  void on_request(const keyframe_request_t& request);
  void publish_state(const NavState& state, const Matrix15d* covariance);
  void publish_scan(const ScanResult& scan, double milliseconds);
  void publish_keyframe(const Keyframe& keyframe);
  void publish_health();

  runtime::IgnisConfig config_;
  runtime::LcmLink link_;
  runtime::ReceiverCounts* imu_counts_ = nullptr;
  runtime::ReceiverCounts* scan_counts_ = nullptr;
  runtime::ReceiverCounts* request_counts_ = nullptr;
  Lio lio_;
  messages::ScanAssembler assembler_;
  std::deque<Keyframe> sent_keyframes_;  // ring for KEYFRAME_REQUEST
  RateLimit resends_{100.0, 100.0};      // keyframes a second; back end and map together ask for at most 85
  Utime newest_utime_ = 0;
  std::int32_t state_sequence_ = 0;
  std::int32_t scan_sequence_ = 0;
  std::int32_t cloud_sequence_ = 0;
};

}  // namespace ignis
