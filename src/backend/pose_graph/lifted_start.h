// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "backend/pose_graph/pose_graph_file.h"

namespace ignis {

/// Poses by descent with more dimensions than there are (`lifted_problem.h`): where the graph itself has a wrong
/// minimum there is a way on through the others. These are then pressed out, ever harder, so that the descent ends
/// where poses exist. `start` may be hardly better than random; the same input gives the same result. The first vertex
/// stays where it is. In the order of the graph's vertices; empty when the edges do not determine all, or when
/// `goes_on`, asked at every step, says no.
[[nodiscard]] std::vector<KeyframePose> lifted_start(const PoseGraph& graph, const std::vector<KeyframePose>& start,
                                                     const std::function<bool()>& goes_on);

}  // namespace ignis
