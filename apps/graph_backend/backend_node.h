// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>

#include "backend/smoother.h"
#include "messages/graph_messages.h"
#include "messages/keyframe_messages.h"
#include "messages/odometry_messages.h"
#include "runtime/lcm_link.h"

namespace ignis {

/// Wires the smoother to the bus. One thread.
class BackendNode {
 public:
  explicit BackendNode(const runtime::Application& application);

  /// Handles what has arrived, asks again for missing keyframes, reports health. Returns within about 100 ms.
  void spin_once();

 private:
  void on_keyframe_part(const keyframe_t& part);
  void on_state(const state_t& message);
  void add_waiting_keyframes();
  void take_keyframe(const Keyframe& keyframe);
  void begin_session(std::int32_t session);
  void request_missing_keyframes();
  void publish_update(const SmootherUpdate& update, const Keyframe& keyframe);
  void publish_revision(const SmootherUpdate& update, bool full);
  void publish_loop(const LoopResult& result);
  void publish_health();

  runtime::IgnisConfig config_;
  runtime::LcmLink link_;
  runtime::ReceiverCounts* keyframe_counts_ = nullptr;
  messages::KeyframeAssembler assembler_;
  std::unique_ptr<Smoother> smoother_;
  std::map<std::int32_t, Keyframe> waiting_;  // arrived before their predecessor
  std::int32_t session_ = -1;
  Pose T_map_odom_;
  Utime newest_utime_ = 0;
  Utime last_smoothed_utime_ = 0;
  std::chrono::steady_clock::time_point last_request_{};
  std::chrono::steady_clock::time_point last_full_{};
  SmootherUpdate last_update_;
  std::string fault_;
  std::int32_t requested_id_ = -1;  // of the gap that is being asked for
  int requests_ = 0;                // made for it
  std::int32_t revision_sequence_ = 0;
  std::int32_t loop_sequence_ = 0;
  std::int32_t state_sequence_ = 0;
  std::int32_t request_sequence_ = 0;
};

}  // namespace ignis
