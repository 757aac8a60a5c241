// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "backend/loops/graph_evidence.h"
#include "backend/smoother_state.h"
#include "backend/solver/incremental_solver.h"

/// Loops that vouch for nothing but each other. A place that looks like another one makes a whole row of matches wrong
/// alike, and in the graph each of them is confirmed by its neighbours. So a loop is judged by what the graph knows
/// without those beside it that say the same. (Loops that are topologically close as one hypothesis: Y. Latif, C.
/// Cadena, J. Neira, "Robust loop closing over time for pose graph SLAM", IJRR 32(14), 2013.)
namespace ignis {

/// The loop at `index` and those beside it in the graph that say the same, and those beside these: indices, nearest
/// first, at most `kLargestGroup`.
inline constexpr std::size_t kLargestGroup = 24;
[[nodiscard]] std::vector<std::size_t> group_of(std::size_t index, const ConsistencyRule& rule,
                                                const SmootherState& state);

/// What the graph without the group says of one of its loops.
struct OutsideView {
  std::size_t index = 0;
  GraphOpinion opinion;
};

/// Of each loop of the group. Empty when the solver cannot tell.
[[nodiscard]] std::vector<OutsideView> seen_from_outside(const std::vector<std::size_t>& group,
                                                         const ConsistencyRule& rule, const IncrementalSolver& solver,
                                                         const SmootherState& state);

}  // namespace ignis
