// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "backend/backend_config.h"
#include "backend/smoother_state.h"
#include "backend/solver/incremental_solver.h"
#include "common/keyframe.h"

/// How a keyframe enters the graph: judged, then linked to the newest node.
namespace ignis {

/// Whether the keyframe may come next; `reason` says why not.
[[nodiscard]] KeyframeVerdict verdict_on(const Keyframe& keyframe, const SmootherState& state, std::string& reason);

/// Whether the keyframe belongs to another drive although session and id fit: the front end was started anew and counts
/// from 0 again. Another instant or pose than that of the node with its id, another predecessor than the newest node,
/// or a stamp that no keyframe between its neighbours can have.
[[nodiscard]] bool is_of_another_drive(const Keyframe& keyframe, const SmootherState& state);

/// Adds the keyframe's variables and factors to the solver and a node to `state`. A refused keyframe leaves both as
/// they were. `left_out` says what was left out of an accepted one.
[[nodiscard]] SolverOutcome append_keyframe(const Keyframe& keyframe, const BackendConfig& config,
                                            IncrementalSolver& solver, SmootherState& state, std::string& left_out);

/// Counts the verdict. A keyframe that would be no better if it were sent again is not waited for any longer.
void count_verdict(KeyframeVerdict verdict, SmootherState& state);

}  // namespace ignis
