// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "backend/pose_graph/pose_graph_file.h"
#include "backend/pose_graph/pose_graph_optimiser.h"

namespace ignis {

/// Wall time since construction.
class Stopwatch {
 public:
  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(Clock::now() - began_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point began_ = Clock::now();
};

/// Tells on the error stream, every few seconds, how far a long solve is.
class SolveProgress {
 public:
  void show(const std::string& text);

 private:
  Stopwatch since_start_;
  double shown_s_ = 0.0;
};

/// Times of single updates.
struct UpdateTimes {
  std::vector<double> seconds;

  [[nodiscard]] double total() const;
  /// `share` 0..1: the smallest time that so many updates do not exceed [s].
  [[nodiscard]] double quantile(double share) const;
};

/// One line of the table: a name, both costs, and what it took.
[[nodiscard]] std::string cost_line(const std::string& name, const PoseGraph& graph, const PoseGraphSolution& solution,
                                    const std::string& effort);

/// Head of the table.
[[nodiscard]] std::string cost_head();

}  // namespace ignis
