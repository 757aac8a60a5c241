// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "backend/backend_config.h"
#include "backend/smoother_state.h"

/// A drive that goes on for a day in the same halls passes each place hundreds of times. Of the keyframes that have
/// retired there, one says all that the graph needs: where the place is, and what it looks like from there. The others
/// are absorbed: their poses stay, everything else is let go, so that the graph hardly grows once the places are known
/// (the reduced pose graph of H. Johannsson et al., "Temporally scalable visual SLAM using a reduced pose graph", ICRA
/// 2013, for what is estimated no more).
namespace ignis {

/// Places, ascending and below `until`, of keyframes that an earlier one stands for: no other stands for that one, it
/// is within `retired_spacing_m`, looks the same way, and comes from another pass. Never one that a loop of the graph
/// or one that waits ends at, nor one that a journal, if there is one, does not hold yet. `until`: at most as many as
/// have retired, less the newest of them, which the chain hangs on.
[[nodiscard]] std::vector<std::size_t> places_to_absorb(std::size_t until, const BackendConfig& config,
                                                        const SmootherState& state);

/// Absorbs the keyframes at these places, ascending, which stay at `poses` [m, map]. Places behind them move up.
/// Returns how many loops, between them and others that have retired, went with them. Requires follow_nodes().
int absorb(std::span<const std::size_t> places, std::span<const KeyframePose> poses, SmootherState& state);

}  // namespace ignis
