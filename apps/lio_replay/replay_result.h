// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "backend/shadow/shadow_optimum.h"
#include "backend/smoother.h"
#include "common/trajectory_file.h"
#include "frontend/lio.h"

namespace ignis {

/// A state of the filter and its published covariance, order of ErrorBlock.
struct UncertainState {
  NavState state;
  Matrix15d covariance;
  Trust trust;
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
  std::map<std::string, std::int64_t> rejected_imu;      ///< by reason
  std::map<std::string, std::int64_t> refused_commands;  ///< to the live front end, by reason
  // Of all sessions: what graph and map did not take.
  int keyframes_refused = 0;      ///< by the graph
  std::string first_refusal;      ///< which keyframe, and why
  std::string solver_failure;     ///< of the first graph that took no more keyframes; empty while all is well
  std::int64_t map_refusals = 0;  ///< poses
};

}  // namespace ignis
