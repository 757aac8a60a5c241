// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "backend/backend_config.h"
#include "backend/incremental_solver.h"
#include "backend/loop_admission.h"
#include "backend/smoother_state.h"

/// A drive without end has a graph without end, unless old keyframes are done with. Beyond `estimated_keyframes` the
/// oldest retire: they stay where the graph has them, as known places that later keyframes are tied to. To condition on
/// them keeps the graph as sparse as it was, where to marginalise them would tie all their neighbours to each other. It
/// takes them for better known than they are, which is made up for in what is published: all that has retired is as
/// uncertain as the newest of it was. (The reduced pose graph of H. Johannsson et al., "Temporally scalable visual SLAM
/// using a reduced pose graph", ICRA 2013, bounds a graph by space instead; it lets go of what inertial sensors say
/// between keyframes.)
namespace ignis {

/// Retires keyframes where too many are estimated, an eighth of them at once, since the solver is built anew for it.
/// Says of loops between them that were on trial that they are kept, and of those that waited that they are forgotten.
[[nodiscard]] LoopEvents retire_oldest(const BackendConfig& config, IncrementalSolver& solver, SmootherState& state);

/// A covariance in body axes of the newest keyframe beside what has retired, against the first keyframe instead.
[[nodiscard]] Matrix6d since_start(const Matrix6d& covariance, const SmootherState& state);

/// The loop between the two, if it stays in the graph because both have retired.
[[nodiscard]] std::optional<LoopResult> retired_loop(std::int32_t from_id, std::int32_t to_id,
                                                     const SmootherState& state);

}  // namespace ignis
