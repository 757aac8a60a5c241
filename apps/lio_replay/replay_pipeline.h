// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "backend/corrected_trajectory.h"
#include "backend/shadow_schedule.h"
#include "backend/smoother.h"
#include "frontend/lio.h"
#include "graph_listener.h"
#include "map/live_map.h"
#include "messages/keyframe_messages.h"
#include "runtime/ignis_config.h"
#include "stage_timer.h"

namespace ignis {

/// A state of the filter and its published covariance, order of ErrorBlock.
struct UncertainState {
  NavState state;
  Matrix15d covariance;
};

/// Everything that a replay produces, before it becomes files.
struct ReplayResult {
  std::vector<ScanStats> scans;
  std::vector<double> scan_times_ms;  ///< wall time of each scan in the front end
  std::vector<LoopResult> loops;
  Trajectory odometry;                 ///< one row per scan, frame odom
  std::vector<UncertainState> states;  ///< on the same stamps
  Trajectory smoothed;                 ///< on the same stamps, frame map of each session
  PoseGraph graph;
  SmootherStats smoother;
  ShadowOptimum optimum;  ///< how far the incremental solution was from the batch optimum at the end
  int sessions = 1;       ///< the front end's; all above but the trajectories is of the newest
  std::string start;      ///< what the front end says about its start
  std::int64_t imu_samples = 0;
  std::map<std::string, std::int64_t> rejected_imu;  ///< by reason
};

/// All cores in one process. Keyframes pass through their message form, so that they carry the same rounding as on the
/// bus and a replay equals the live run; the batch optimum is taken over where the back end does (ShadowSchedule), and
/// once more at the end. When the front end begins a new session, so do graph and map, as in the processes: their
/// numbers and files are of the newest session, the trajectories of all.
class ReplayPipeline {
 public:
  /// `listener` may be null; it outlives the pipeline.
  ReplayPipeline(const runtime::IgnisConfig& config, bool use_loops, GraphListener* listener = nullptr);

  void add_imu(const ImuSample& sample);
  void add_scan(Scan scan);

  /// Places everything at its final pose. Call once, at the end.
  [[nodiscard]] ReplayResult finish();

  /// The map of the drive, rebuilt from the final poses.
  [[nodiscard]] const ThreeLevelMap& voxels() const { return map_.voxels(); }

  [[nodiscard]] const StageTimer& frontend_timer() const { return frontend_timer_; }
  [[nodiscard]] const StageTimer& backend_timer() const { return backend_timer_; }
  [[nodiscard]] const StageTimer& batch_timer() const { return batch_timer_; }
  [[nodiscard]] const StageTimer& map_timer() const { return map_timer_; }

 private:
  void take(const ScanResult& scan, double milliseconds);
  void follow_session(std::int32_t session);
  void take_keyframe(const Keyframe& keyframe);
  void adopt_due_optimum();
  void publish(const SmootherUpdate& update);
  void settle_graph();
  void correct_map(const SmootherUpdate& update);
  void rebuild_map();

  BackendConfig backend_config_;
  LoopGates loop_gates_;
  Lio lio_;
  Smoother smoother_;
  ShadowSchedule schedule_;
  ShadowProblem problem_;  // copied when the schedule began; solved when it is due
  Utime newest_keyframe_ = 0;
  LiveMap map_;
  messages::KeyframeAssembler assembler_;
  std::map<std::int32_t, KeyframeCorrection> keyframes_;
  std::int32_t session_ = 0;
  GraphListener* listener_;
  ReplayResult result_;
  StageTimer frontend_timer_;
  StageTimer backend_timer_;
  StageTimer batch_timer_;  // of the batch optimum, which the live back end computes on a second thread
  StageTimer map_timer_;
};

}  // namespace ignis
