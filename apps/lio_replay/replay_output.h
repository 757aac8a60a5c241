// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "graph_agreement.h"
#include "live_agreement.h"
#include "replay_input.h"
#include "replay_pipeline.h"
#include "runtime/application.h"

namespace ignis {

/// How long the replay took.
struct ReplayTiming {
  double wall_s = 0.0;  ///< reading, cores and all
};

/// What a replay was asked for and what it read.
struct ReplaySource {
  std::filesystem::path log;
  const ReplayInput& input;
  LiveAgreement live;    ///< with the live run in the same log
  GraphAgreement graph;  ///< the same of its back end
};

/// Writes eskf.tum, smoothed.tum, ground_truth.tum (where the log has it), keyframes.g2o, map.pcd, map.ply,
/// scan_stats.csv, eskf_states.csv, loops.csv, timing.csv, config.json and report.json into `folder`. Two replays of
/// one log with one build differ in timing.csv and in the timing section of report.json alone. Each file appears under
/// its name only when it is complete. Returns the path of the report.
std::filesystem::path write_results(const std::filesystem::path& folder, const runtime::Application& application,
                                    const ReplaySource& source, const ReplayPipeline& pipeline,
                                    const ReplayResult& result, const ReplayTiming& timing);

/// Fingerprint of both trajectories: equal for two replays of one log with one build.
[[nodiscard]] std::string trajectory_hash(const ReplayResult& result);

}  // namespace ignis
