// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "backend/smoother_state.h"
#include "backend/solver/incremental_solver.h"

/// What a call of the smoother tells the outside of the graph.
namespace ignis {

/// Reads the poses that the solver has moved since the last call, and those of new nodes.
void refresh_poses(IncrementalSolver& solver, SmootherState& state);

/// Takes odom to map at the newest node; the identity while there is none.
[[nodiscard]] Pose T_map_odom(const SmootherState& state);

/// Fills revision, newest state and covariance of `update`, and lists what moved since it was last listed.
void report_revision(IncrementalSolver& solver, SmootherState& state, SmootherUpdate& update);

/// The same as it stands, without poses.
[[nodiscard]] SmootherUpdate present_revision(IncrementalSolver& solver, const SmootherState& state);

/// All keyframes as the graph places them, ascending ids.
[[nodiscard]] std::vector<KeyframePose> all_poses(const SmootherState& state);

/// Poses, odometry and loops for keyframes.g2o, without keyframes that were absorbed.
[[nodiscard]] PoseGraph exported_graph(const SmootherState& state);

}  // namespace ignis
