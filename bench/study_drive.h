// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "backend/smoother.h"
#include "common/keyframe.h"

/// Drives over which defences against wrong loops are compared: keyframes, the truth, and true loops.
namespace ignis::bench {

struct StudyDrive {
  std::vector<Keyframe> keyframes;     ///< without clouds: loops are handed in
  std::vector<Pose> T_world_body;      ///< true, one per keyframe
  std::vector<LoopMeasurement> loops;  ///< true ones, ascending from_id
};

/// Recorded keyframes and the loops that the search finds among them; those that are more than 0.5 m from the truth are
/// left out.
[[nodiscard]] StudyDrive recorded_study(const std::filesystem::path& keyframe_log,
                                        const std::filesystem::path& ground_truth, const BackendConfig& config,
                                        const LoopGates& gates);

/// Five laps of the synthetic drive of test/backend, with a true loop at every second keyframe from the second lap on.
[[nodiscard]] StudyDrive synthetic_study(unsigned seed);

}  // namespace ignis::bench
