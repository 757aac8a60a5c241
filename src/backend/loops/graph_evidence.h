// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <utility>

#include "backend/backend_config.h"
#include "backend/loops/loop_consistency.h"
#include "backend/loops/loop_evidence.h"
#include "backend/smoother_state.h"
#include "backend/solver/incremental_solver.h"

/// What the graph says of loops, in it or not.
namespace ignis {

/// The variables between which it stands: the earlier pose and the later one, whose body axes it is seen in.
[[nodiscard]] IncrementalSolver::KeyPair ends_of(const GraphLoop& loop);

/// The tests of loops against each other and against the odometry, as configured.
[[nodiscard]] ConsistencyRule rule_of(const BackendConfig& config);

/// What it claims, by the places of its ends in the chain.
[[nodiscard]] LoopClaim claim_of(const GraphLoop& loop, const SmootherState& state);

/// The loops beside each other, linearised where the solver's factors are. Nothing when the solver cannot tell.
[[nodiscard]] std::optional<LoopEvidence> evidence_of(std::span<const GraphLoop* const> loops,
                                                      const IncrementalSolver& solver, const SmootherState& state);

/// A loop's claim beside what the graph knows without it.
struct GraphOpinion {
  /// What the chi-square would rise by with the loop: the squared Mahalanobis distance of its claim from the graph's
  /// prediction, with the covariance of both.
  ChiSquareTest test;
  double open_m = 0.0;  ///< [m] largest sigma of the place of its later end, scaled by the rule

  /// The test would have refused a loop that is wrong by more than this.
  [[nodiscard]] double largest_error_m() const;
};

/// Of the loop at `i`, which is not in the graph.
[[nodiscard]] GraphOpinion opinion_on(const LoopEvidence& evidence, std::size_t i, const ConsistencyRule& rule);

/// The same of a loop by itself.
[[nodiscard]] GraphOpinion opinion_on(const GraphLoop& loop, const ConsistencyRule& rule,
                                      const IncrementalSolver& solver, const SmootherState& state);

}  // namespace ignis
