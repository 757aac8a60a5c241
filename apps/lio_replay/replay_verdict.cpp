// SPDX-License-Identifier: Apache-2.0
#include "replay_verdict.h"

#include <format>

namespace ignis {

std::string refusals(const ReplayResult& result) {
  std::string text;
  if (result.keyframes_refused > 0) {
    text += std::format("{} keyframes by the graph, the first: {}", result.keyframes_refused, result.first_refusal);
  }
  if (result.map_refusals > 0) {
    text += std::format("{}{} poses by the map", text.empty() ? "" : "; ", result.map_refusals);
  }
  return text;
}

runtime::ExitCode verdict(const ReplayResult& result, const LogInventory& inventory, bool stopped) {
  if (result.odometry.empty()) {
    throw runtime::UserError(std::format("no pose was computed: {}", result.start), runtime::kFailed);
  }
  if (!result.solver_failure.empty()) {
    throw runtime::UserError(
        std::format("the graph ends before the drive does: {}; the results are there", result.solver_failure),
        runtime::kFailed);
  }
  if (stopped) return runtime::kFailed;
  return inventory.incomplete() || !refusals(result).empty() ? runtime::kInputDamaged : runtime::kDone;
}

}  // namespace ignis
