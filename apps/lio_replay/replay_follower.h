// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "backend/keyframes/corrected_trajectory.h"
#include "backend/shadow/shadow_schedule.h"
#include "backend/smoother.h"
#include "frontend/lio.h"
#include "graph_listener.h"
#include "map/live_map.h"
#include "messages/keyframe_messages.h"
#include "replay_result.h"
#include "runtime/ignis_config.h"
#include "stage_timer.h"

namespace ignis {

/// Back end and map of a replay, as they follow the front end: all that depends on nothing but its results, in their
/// order. Keyframes pass through their message form, so that they carry the same rounding as on the bus and a replay
/// equals the live run; the batch optimum is taken over where the back end does (ShadowSchedule), and once more at the
/// end. When the front end begins a new session, so do graph and map, as in the processes.
class ReplayFollower {
 public:
  /// `listener` may be null; it outlives the follower.
  ReplayFollower(const runtime::IgnisConfig& config, bool use_loops, GraphListener* listener, std::int32_t session = 0);

  /// `milliseconds`: what the scan took in the front end.
  void take(const ScanResult& scan, double milliseconds);

  /// Places everything at its final pose. Call once, at the end.
  [[nodiscard]] ReplayResult finish();

  /// The map of the drive, rebuilt from the final poses.
  [[nodiscard]] const ThreeLevelMap& voxels() const { return map_.voxels(); }

  [[nodiscard]] const StageTimer& backend_timer() const { return backend_timer_; }
  [[nodiscard]] const StageTimer& batch_timer() const { return batch_timer_; }
  [[nodiscard]] const StageTimer& map_timer() const { return map_timer_; }

 private:
  void follow_session(std::int32_t session);
  void take_keyframe(const Keyframe& keyframe);
  void adopt_due_optimum();
  void publish(const SmootherUpdate& update);
  void note_refusal(const Keyframe& keyframe, const std::string& reason);
  void settle_graph();
  void correct_map(const SmootherUpdate& update);
  void rebuild_map();

  BackendConfig backend_config_;
  LoopGates loop_gates_;
  Smoother smoother_;
  ShadowSchedule schedule_;
  ShadowProblem problem_;  // copied when the schedule began; solved when it is due
  Utime newest_keyframe_ = 0;
  LiveMap map_;
  messages::KeyframeAssembler assembler_;
  std::map<std::int32_t, KeyframeCorrection> keyframes_;
  std::int32_t session_;
  GraphListener* listener_;
  ReplayResult result_;
  StageTimer backend_timer_;
  StageTimer batch_timer_;  // of the batch optimum, which the live back end computes on a second thread
  StageTimer map_timer_;
};

}  // namespace ignis
