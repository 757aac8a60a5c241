// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "backend/backend_config.h"
#include "backend/shadow/shadow_optimum.h"
#include "backend/smoother_state.h"
#include "backend/solver/incremental_solver.h"

/// The shadow optimum's side towards the smoother.
namespace ignis {

[[nodiscard]] ShadowProblem shadow_problem(IncrementalSolver& solver, const SmootherState& state);

/// Notes the gap; the solver goes on from the optimum when it was farther away than configured. True when it did.
[[nodiscard]] bool take_over(const ShadowOptimum& optimum, const BackendConfig& config, IncrementalSolver& solver,
                             SmootherState& state);

}  // namespace ignis
