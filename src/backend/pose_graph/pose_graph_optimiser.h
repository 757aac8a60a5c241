// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "backend/pose_graph/pose_graph_file.h"
#include "backend/pose_graph/pose_graph_variables.h"
#include "backend/solver/incremental_solver.h"

namespace ignis {

/// What a solution was reached from.
enum class PoseGraphStart : std::uint8_t { kStoredPoses, kPoseByPose, kChordalRelaxation, kLiftedDescent };

[[nodiscard]] std::string_view words_of(PoseGraphStart start);

struct PoseGraphSolution {
  std::vector<KeyframePose> poses;  ///< in the order of the graph's vertices
  double half_chi_square = 0.0;     ///< of the edges alone
  PoseGraphStart start = PoseGraphStart::kStoredPoses;
  std::string given_up;  ///< why further starts were not tried to their end, such as want of memory; empty: they were
};

/// Told again and again which start is being worked from; false ends the work there, and the lowest cost so far stands.
using SettlingObserver = std::function<bool(PoseGraphStart start)>;

/// Solves a graph of relative poses incrementally, as the back end does on the vehicle: a pose enters when an edge
/// connects it to those that are in (of several, the one that comes first in the file), with all its edges to them,
/// first guessed through the edge to the most recent one. The stored vertex poses are not used except for the first,
/// which is held. One thread; whoever calls measures the time.
class PoseGraphOptimiser {
 public:
  /// Keeps a reference to `graph`. Throws std::runtime_error naming the vertices that no chain of edges joins to the
  /// first one, and config::ConfigError naming every offence of `config`.
  PoseGraphOptimiser(const PoseGraph& graph, const SolverConfig& config);

  [[nodiscard]] std::size_t entered() const { return entered_; }
  [[nodiscard]] bool complete() const { return entered_ == order_.size(); }

  /// One update of the solver. Requires !complete(). Throws std::runtime_error when the solver refuses the pose.
  void add_next();

  /// Settles the whole graph: updates without news, then batch steps from where they end, as the back end swaps in its
  /// batch optimum. Where edges err by a tenth of a radian and more, pose by pose may have led into a wrong minimum;
  /// so batch steps from the chordal relaxation are tried as well, and where these end elsewhere, others from the
  /// lifted descent. The lowest cost stands, also when a further start fails. Requires complete().
  [[nodiscard]] PoseGraphSolution finish(const SettlingObserver& observer);

 private:
  /// A vertex and its edges to those that enter before it.
  struct Entry {
    std::size_t vertex = 0;
    std::vector<const PoseGraphEdge*> edges;
  };

  [[nodiscard]] static std::vector<Entry> entry_order(const PoseGraph& graph);

  [[nodiscard]] Pose pose(std::int32_t id);
  void try_further_starts(PoseGraphSolution& best, const SettlingObserver& observer) const;

  const PoseGraph& graph_;
  PoseGraphVariables variables_;
  int relinearize_skip_;
  std::vector<Entry> order_;
  std::unordered_map<std::int32_t, std::size_t> place_in_entry_;  ///< of the ids that are in: how many came before
  IncrementalSolver solver_;
  std::size_t entered_ = 0;
};

/// All steps of PoseGraphOptimiser at once.
[[nodiscard]] PoseGraphSolution optimise_pose_graph(const PoseGraph& graph, const SolverConfig& config);

/// Told after each iteration of a batch solve; false ends it there.
using BatchObserver = std::function<bool(std::size_t iteration, double half_chi_square)>;

/// Levenberg-Marquardt over the whole graph, from the stored vertex poses; the first vertex is held. What a wrong
/// minimum near those poses holds it keeps. Throws std::runtime_error when the solver does.
[[nodiscard]] PoseGraphSolution optimise_in_batch(const PoseGraph& graph, const BatchObserver& observer);

}  // namespace ignis
