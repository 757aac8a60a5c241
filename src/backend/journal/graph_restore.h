// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "backend/journal/graph_change.h"
#include "backend/solver/incremental_solver.h"

/// Between the solver and the journal.
namespace ignis {

/// Where the solver has linearised the keyframes that are new, or that it had linearised elsewhere when this was asked
/// last. Ascending.
[[nodiscard]] std::vector<LinearisationPoint> take_linearised(IncrementalSolver& solver);

/// Gives a fresh solver all factors of `graph` in one update, linearised where they were, and fills what follows from
/// it: poses, and the loops' factor ids. The reason when the solver refuses; empty when all is well.
[[nodiscard]] std::string restore_solver(RestoredGraph& graph, const BackendConfig& config, IncrementalSolver& solver);

}  // namespace ignis
