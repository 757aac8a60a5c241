// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "backend/backend_config.h"
#include "backend/loops/loop_result.h"
#include "backend/smoother_state.h"
#include "common/loop_gates.h"

namespace ignis {

/// What the newest keyframe found.
struct LoopProposal {
  LoopResult result;         ///< stage kVerified: confirmed by the match, not yet judged by the others
  WhiteningRows rows{0, 6};  ///< of the relative pose, body axes of the newest

  [[nodiscard]] bool verified() const { return result.stage == LoopStage::kVerified; }
};

/// The pair, or one whose ends both lie within `spacing` keyframes of it, was vetoed.
[[nodiscard]] bool is_vetoed(std::span<const LoopVeto> vetoes, std::int32_t from_id, std::int32_t to_id, int spacing);

/// Looks for a loop that ends at the newest keyframe, unless one was closed only just. Up to loop_max_candidates are
/// matched, and the first one that is verified wins. If none is, the one with the largest matched fraction tells why,
/// the older one on a tie. Requires follow_nodes(). A candidate whose surroundings are lost (CloudStore) is refused.
[[nodiscard]] LoopProposal search_loop(SmootherState& state, const BackendConfig& config, const LoopGates& gates);

}  // namespace ignis
