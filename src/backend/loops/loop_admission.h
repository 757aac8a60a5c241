// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "backend/backend_config.h"
#include "backend/smoother_state.h"
#include "backend/solver/incremental_solver.h"

/// Which verified loops may be in the graph. A loop must agree with the odometry between its ends and belong to the
/// largest set of loops that agree with each other; where odometry leaves much open, another member of that set must
/// pin it down. What the graph contradicts waits, and is judged again beside the loops that come later. What enters is
/// on trial, and kept after some keyframes without contradiction, if odometry or the graph without its neighbours that
/// say the same is sure of it.
namespace ignis {

/// Changes of loops' stages in their order, each as it is to be published.
using LoopEvents = std::vector<GraphLoop>;

/// Judges a verified loop with the others. Its last event tells what became of it.
[[nodiscard]] LoopEvents admit_loop(const LoopResult& result, const WhiteningRows& rows, const BackendConfig& config,
                                    IncrementalSolver& solver, SmootherState& state);

/// After a keyframe: loops that the graph contradicts by now go, loops that have stood their trial are kept.
[[nodiscard]] LoopEvents review_loops(const BackendConfig& config, IncrementalSolver& solver, SmootherState& state);

/// An operator takes every loop between the two keyframes out, in the graph or waiting.
[[nodiscard]] LoopEvents dismiss_loops(std::int32_t from_id, std::int32_t to_id, IncrementalSolver& solver,
                                       SmootherState& state);

}  // namespace ignis
