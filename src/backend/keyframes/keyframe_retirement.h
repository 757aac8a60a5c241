// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "backend/backend_config.h"
#include "backend/loops/loop_admission.h"
#include "backend/smoother_state.h"
#include "backend/solver/incremental_solver.h"

namespace gtsam {
class NonlinearFactorGraph;
}

/// A drive without end has a graph without end, unless old keyframes are done with. Beyond `estimated_keyframes` the
/// oldest retire, if they are known to a decimetre: their poses stay where the graph has them, as known places that
/// later keyframes are tied to. To condition on them keeps the graph as sparse as it was, where to marginalise them
/// would tie all their neighbours to each other. It takes them for exact, within the graph and where loops are judged.
/// So velocity and biases of the newest that has retired are held to what its past says of them with all poses in
/// doubt, and what is published adds how unsure those places are. A drive that explores for hours without a loop has
/// nothing that is known so well, and its graph grows. (The reduced pose graph of H. Johannsson et al., "Temporally
/// scalable visual SLAM using a reduced pose graph", ICRA 2013, bounds a graph by space instead; it lets go of what
/// inertial sensors say between keyframes.)
namespace ignis {

/// Retires keyframes where too many are estimated, an eighth of these at once, since the solver is built anew for it.
/// Says of loops between them that were on trial that they are kept, and of those that waited that they are forgotten.
[[nodiscard]] LoopEvents retire_oldest(const BackendConfig& config, IncrementalSolver& solver, SmootherState& state);

/// Ties what is estimated to the velocity and biases of the newest keyframe that has retired, if any has.
void add_retired_motion(const SmootherState& state, gtsam::NonlinearFactorGraph& factors);

/// A covariance in body axes of the newest keyframe beside what has retired, against the first keyframe instead.
[[nodiscard]] Matrix6d since_start(const Matrix6d& covariance, const SmootherState& state);

/// The loop between the two, if it stays in the graph because both have retired. Of one that went with an absorbed
/// keyframe no more than that is known.
[[nodiscard]] std::optional<LoopResult> retired_loop(std::int32_t from_id, std::int32_t to_id,
                                                     const SmootherState& state);

}  // namespace ignis
