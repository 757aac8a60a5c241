// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "backend/pose_graph/pose_graph_file.h"

namespace ignis {

/// Cost of poses by the measure of SE-Sync (D. M. Rosen, L. Carlone, A. S. Bandeira, J. J. Leonard, "SE-Sync: A
/// certifiably correct algorithm for synchronization over the special Euclidean group", IJRR 38(2-3), 2019), by which
/// the optima of published graphs are known: the sum over edges of kappa ||R_j - R_i R_ij||_F^2 +
/// tau ||t_j - t_i - R_i t_ij||^2. In space tau = 3 / tr(translation information^-1) and
/// kappa = 3 / (2 tr(attitude information^-1)); in the plane tau = 2 / tr(translation information^-1) and kappa is the
/// information of the heading. Nothing when an edge leaves a direction free. `poses` are those of graph.vertices, in
/// any order; throws std::out_of_range when an edge names a vertex that is not among them.
[[nodiscard]] std::optional<double> se_sync_cost(const PoseGraph& graph, const std::vector<KeyframePose>& poses);

}  // namespace ignis
