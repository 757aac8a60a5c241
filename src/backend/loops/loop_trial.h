// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "backend/backend_config.h"
#include "backend/smoother_state.h"
#include "backend/solver/incremental_solver.h"

/// Loops inside the graph: how they enter, and which one must go when the graph contradicts itself.
namespace ignis {

/// What the entry of a loop did to the graph.
struct LoopEntry {
  bool entered = false;
  std::string refusal;
  /// Rise of the chi-square of the graph, or a larger number that can be believed too. In a linear graph the rise is
  /// the squared Mahalanobis distance of the loop from what the graph had predicted, with the covariance of both; with
  /// the loop's own covariance alone it is larger.
  double rise = 0.0;
};

/// Moves `loop` into the graph, on trial. A refused one is gone.
[[nodiscard]] LoopEntry enter_graph(GraphLoop loop, const BackendConfig& config, IncrementalSolver& solver,
                                    SmootherState& state);

/// Takes the loop at `index` out of the graph and hands it back with `reason_text`, stage kWithdrawn.
GraphLoop leave_graph(std::size_t index, const std::string& reason_text, IncrementalSolver& solver,
                      SmootherState& state);

/// A loop that the rest of the graph contradicts.
struct ContradictedLoop {
  std::size_t index = 0;
  double chi_square = 0.0;
  double bound = 0.0;
};

/// Nothing while every loop's error can be believed, and the rise that the newest one caused too; otherwise the loop
/// without which the graph would gain most, measured by its bound: not the newest one, nor the one with the largest
/// error, for a tight true loop drags less than a false one that bends the odometry. (The chi-square that a measurement
/// costs is r^T (I - H)^-1 r with the whitened residual r and its leverage H; R. D. Cook, S. Weisberg, "Residuals and
/// Influence in Regression", 1982, section 2.2.)
[[nodiscard]] std::optional<ContradictedLoop> contradicted_loop(double newest_rise, const BackendConfig& config,
                                                                IncrementalSolver& solver, const SmootherState& state);

}  // namespace ignis
