// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "backend/shadow/shadow_schedule.h"
#include "background_solve.h"
#include "common/leap_guard.h"
#include "keyframe_inbox.h"
#include "lasting_graph.h"
#include "messages/graph_messages.h"
#include "messages/keyframe_messages.h"
#include "messages/odometry_messages.h"
#include "runtime/lcm_link.h"
#include "runtime/rate_limit.h"
#include "runtime/recent_rise.h"

namespace ignis {

/// Wires the smoother to the bus. One thread, and a second one for each batch solution beside it.
class BackendNode {
 public:
  /// `journal_folder` may be empty: then a killed process begins anew.
  BackendNode(const runtime::Application& application, const std::filesystem::path& journal_folder);

  /// Handles what has arrived, asks again for missing keyframes, reports health. Returns within about 100 ms.
  void spin_once();

 private:
  void on_keyframe_part(const keyframe_t& part);
  void on_state(const state_t& message);
  [[nodiscard]] const char* on_command(const graph_command_t& command);
  void add_waiting_keyframes();
  [[nodiscard]] bool refuse_damaged(const Keyframe& keyframe);
  [[nodiscard]] bool is_next_state(const NavState& state);
  void begin_session(std::int32_t session);
  void request_missing_keyframes();
  void give_up_before(std::int32_t id);
  void adopt_due_optimum();
  void begin_due_optimum();
  void publish_update(const SmootherUpdate& update);
  void publish_full_set();
  void publish_revision(const SmootherUpdate& update, bool full);
  void publish_loop(const LoopResult& result);
  void publish_health();

  runtime::IgnisConfig config_;
  runtime::LcmLink link_;
  runtime::ReceiverCounts* keyframe_counts_ = nullptr;
  runtime::ReceiverCounts* state_counts_ = nullptr;
  messages::KeyframeAssembler assembler_;
  LastingGraph graph_;
  KeyframeInbox inbox_;
  RateLimit commands_{10.0, 50.0};  // a person, or a script that vetoes what it has found
  ShadowSchedule schedule_;
  BackgroundSolve optimum_;
  Pose T_map_odom_;
  Utime newest_utime_ = 0;
  std::optional<Utime> newest_state_;  // [us] of LIO_STATE
  LeapGuard state_leaps_;
  Utime last_smoothed_utime_ = 0;
  std::chrono::steady_clock::time_point last_full_{};
  SmootherUpdate last_update_;
  runtime::RecentRise cloud_losses_{std::chrono::seconds(60)};
  std::int64_t keyframes_given_up_ = 0;
  runtime::RecentRise keyframe_losses_{std::chrono::seconds(60)};
  std::string refusal_;  // of the newest keyframe; empty when it was accepted
  std::int32_t revision_sequence_ = 0;
  std::int32_t loop_sequence_ = 0;
  std::int32_t state_sequence_ = 0;
  std::int32_t request_sequence_ = 0;
};

}  // namespace ignis
