// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "backend/incremental_solver.h"
#include "backend/pose_graph_file.h"

namespace ignis {

struct PoseGraphSolution {
  std::vector<KeyframePose> poses;  ///< in the order of the graph's vertices
  double half_chi_square = 0.0;     ///< of the edges alone
};

/// Solves a graph of relative poses incrementally, as the back end does on the vehicle: each pose enters with all its
/// edges to earlier poses, first guessed through the edge from its predecessor; the stored vertex poses are not used
/// except for the first, which is held. Throws std::runtime_error when a pose has no edge to an earlier one or the
/// solver refuses an edge.
[[nodiscard]] PoseGraphSolution optimise_pose_graph(const PoseGraph& graph, const SolverConfig& config);

}  // namespace ignis
