// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "backend/backend_config.h"
#include "backend/pose_graph/pose_graph_file.h"
#include "backend/smoother.h"
#include "backend/smoother_state.h"
#include "backend/solver/incremental_solver.h"

namespace ignis::bench {

/// The back end's decision about loops over a graph of poses alone: the same admission, trial and review in the same
/// order as Smoother's, without IMU, velocities, clouds and search.
class GraphCourt {
 public:
  explicit GraphCourt(const BackendConfig& config) : config_(config), solver_(config.solver) {}

  /// The first pose, which is held.
  void begin(const Pose& T_map_body);

  /// The next pose. Throws std::runtime_error when the solver refuses it.
  void add(const PoseGraphEdge& step);

  void judge(const LoopMeasurement& loop);

  [[nodiscard]] std::vector<Pose> poses() const;

  /// Whether the loop that was judged as the `number`th, counted from 0, is in the graph.
  [[nodiscard]] bool holds(std::int32_t number) const;

 private:
  void append(GraphNode node);

  BackendConfig config_;
  IncrementalSolver solver_;
  SmootherState state_;
};

}  // namespace ignis::bench
