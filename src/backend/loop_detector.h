// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "backend/keyframe_pose.h"
#include "common/loop_gates.h"

namespace ignis {

/// The geometric candidate test of the reference: horizontal distance (X and Z) at most loop_radius_m, heading
/// difference at most loop_yaw_rad, and at least loop_min_index_gap keyframes back.
[[nodiscard]] bool is_loop_candidate(const KeyframePose& current, const KeyframePose& earlier, const LoopGates& gates);

/// Indices into `poses` (ascending ids) of the candidates for `current`, oldest first.
[[nodiscard]] std::vector<std::size_t> loop_candidates(std::span<const KeyframePose> poses, const KeyframePose& current,
                                                       const LoopGates& gates);

/// Which candidates are worth a scan match: the oldest, then the nearest ones that lie more than `spacing` places away
/// from those already chosen (their local maps would overlap), at most `count` in all.
[[nodiscard]] std::vector<std::size_t> choose_candidates(std::span<const std::size_t> candidates,
                                                         std::span<const KeyframePose> poses,
                                                         const KeyframePose& current, std::size_t count,
                                                         std::size_t spacing);

}  // namespace ignis
