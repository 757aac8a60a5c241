// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "backend/backend_config.h"
#include "backend/smoother_state.h"
#include "backend/solver/incremental_solver.h"

/// Verified loops that the graph contradicts, against those in it. One that stands alone is wrong. But where a wrong
/// one came first, or a group of them, every true one is contradicted: so those that are contradicted wait, and when
/// more of them would stand together than would have to leave for it, they change places.
namespace ignis {

/// Numbers of loops.
struct LoopExchange {
  std::vector<std::int32_t> leaving;
  std::vector<std::int32_t> entering;
};

/// The exchange after which more loops are in the graph, without contradiction, than before. `challengers` wait
/// outside; the first one is the newest.
[[nodiscard]] std::optional<LoopExchange> better_exchange(std::span<const GraphLoop> challengers,
                                                          const BackendConfig& config, const IncrementalSolver& solver,
                                                          const SmootherState& state);

}  // namespace ignis
