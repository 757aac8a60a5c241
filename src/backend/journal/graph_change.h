// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "backend/journal/loop_list_change.h"
#include "backend/smoother_state.h"

/// What one call changed in the graph, as the journal keeps it. All changes from the first one on, applied in order,
/// give back the whole state and the points at which the solver had linearised, so that a solver built from them stands
/// where the old one stood.
namespace ignis {

/// Where a keyframe's variables are linearised; fields named odom are in map.
struct LinearisationPoint {
  std::int32_t id = 0;
  NavState state;
};

struct GraphChange {
  /// Scalars as they are now; nodes and vetoes: the new ones; links: those of new nodes that have not retired; no
  /// loops.
  SmootherState state;
  std::optional<RetiredKeyframes> retired;     ///< if more have; blocks and loops: the new ones
  std::vector<std::int32_t> absorbed;          ///< ids of keyframes that were absorbed after that, ascending
  std::vector<CompactCloud> clouds;            ///< one per new node
  LoopListChange loops;                        ///< those in the graph
  LoopListChange waiting;                      ///< those outside of it
  std::vector<LinearisationPoint> linearised;  ///< the new ones and those that moved
};

[[nodiscard]] std::vector<std::byte> encode_change(const GraphChange& change);

/// Nothing when the bytes are no change. Never reads beyond them.
[[nodiscard]] std::optional<GraphChange> decode_change(std::span<const std::byte> bytes);

/// State and linearisation points by node (of those that have retired: where they stay), as the changes so far leave
/// them.
struct RestoredGraph {
  explicit RestoredGraph(BackendConfig how) : config(std::move(how)) {}

  BackendConfig config;
  SmootherState state;
  std::vector<LinearisationPoint> linearised;
  std::size_t changes = 0;  ///< applied so far: the number of the next one's record

  /// The reason why `change` cannot follow, and then nothing is altered; empty when it was applied.
  [[nodiscard]] std::string apply(GraphChange change);

 private:
  void let_go(std::span<const std::int32_t> absorbed);
};

/// Finds what changed since it looked last. Keyframes must not retire twice in between.
class ChangeTracker {
 public:
  ChangeTracker();

  /// Begins at a graph that is known already.
  explicit ChangeTracker(const RestoredGraph& known);

  /// `linearised`: of the nodes of `state` that are new or whose point has moved since.
  [[nodiscard]] GraphChange next(const SmootherState& state, std::vector<LinearisationPoint> linearised);

 private:
  [[nodiscard]] RetiredKeyframes newly_retired(const SmootherState& state, std::size_t absorbed) const;

  std::size_t nodes_ = 0;
  std::size_t retired_ = 0;             ///< of these, those that had retired
  std::vector<std::int32_t> absorbed_;  ///< ids, ascending
  LoopListMemory loops_;
  LoopListMemory waiting_;
  std::size_t vetoes_ = 0;
};

}  // namespace ignis
