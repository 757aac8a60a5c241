// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "backend/backend_config.h"
#include "backend/keyframe_pose.h"
#include "backend/loop_result.h"
#include "common/loop_gates.h"
#include "common/measurements.h"

namespace ignis {

/// The best match of the newest keyframe with an earlier one.
struct LoopProposal {
  LoopResult result;                        ///< kAccepted: verified by the match, not yet on trial
  Matrix6d information = Matrix6d::Zero();  ///< of the match alone; attitude then position, body axes of the newest
};

/// Looks for a loop that ends at the newest keyframe, the last of `poses`. `clouds` holds the body cloud of each. Up to
/// loop_max_candidates are matched; the verified one with the largest matched fraction wins, the older one on a tie.
[[nodiscard]] LoopProposal search_loop(std::span<const KeyframePose> poses,
                                       std::span<const std::vector<CloudPoint>> clouds, const BackendConfig& config,
                                       const LoopGates& gates);

}  // namespace ignis
