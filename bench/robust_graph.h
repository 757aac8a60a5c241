// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "backend/factors/keyframe_factors.h"
#include "backend/smoother.h"

namespace ignis::bench {

/// What stands in for a decision about a loop.
enum class Kernel {
  kNone,    ///< every loop weighs what it claims
  kHuber,   ///< linear beyond 3.5 sigma
  kCauchy,  ///< logarithmic; half its weight is gone at 2.4 sigma
};

/// The graph of the back end without any decision about loops: all enter and stay, under a robust kernel. For
/// comparison with trial and withdrawal only.
class RobustGraph {
 public:
  RobustGraph(const BackendConfig& config, Kernel kernel) : config_(config), kernel_(kernel), solver_(config.solver) {}

  /// Throws std::runtime_error when the solver refuses.
  void add(const Keyframe& keyframe);
  void add(const LoopMeasurement& loop);

  [[nodiscard]] std::vector<Pose> poses();

 private:
  BackendConfig config_;
  Kernel kernel_;
  IncrementalSolver solver_;
  std::vector<LinkEnd> ends_;  // without estimates
};

}  // namespace ignis::bench
