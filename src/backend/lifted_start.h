// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "backend/pose_graph_file.h"

namespace ignis {

/// Poses by descent with more dimensions than there are (`lifted_problem.h`): where the graph itself has a wrong
/// minimum there is a way on through the others. These are then pressed out, ever harder, so that the descent ends
/// where poses exist. It begins near `start`, which needs hardly be better than random, as nothing depends on chance:
/// the first vertex stays where it is. In the order of the graph's vertices; empty when the edges do not determine all.
[[nodiscard]] std::vector<KeyframePose> lifted_start(const PoseGraph& graph, const std::vector<KeyframePose>& start);

}  // namespace ignis
