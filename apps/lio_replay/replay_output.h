// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "replay_input.h"
#include "replay_pipeline.h"
#include "runtime/application.h"

namespace ignis {

/// How long the replay took.
struct ReplayTiming {
  double wall_s = 0.0;  ///< reading, cores and all
};

/// Writes eskf.tum, smoothed.tum, ground_truth.tum (where the log has it), keyframes.g2o, map.pcd, map.ply,
/// scan_stats.csv, loops.csv, config.json and report.json into `folder`. Each file appears under its name only when it
/// is complete. Returns the path of the report.
std::filesystem::path write_results(const std::filesystem::path& folder, const runtime::Application& application,
                                    const std::filesystem::path& log, const ReplayInput& input,
                                    const ReplayPipeline& pipeline, const ReplayResult& result,
                                    const ReplayTiming& timing);

/// What a person wants to know, in a few lines.
[[nodiscard]] std::string summary(const ReplayInput& input, const ReplayResult& result, const ReplayTiming& timing);

/// Fingerprint of both trajectories: equal for two replays of one log with one build.
[[nodiscard]] std::string trajectory_hash(const ReplayResult& result);

}  // namespace ignis
