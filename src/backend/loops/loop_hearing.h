// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "backend/backend_config.h"
#include "backend/loops/loop_consistency.h"
#include "backend/smoother_state.h"

namespace ignis {

/// The court in session: one claim per loop that may testify, those in the graph first. Odometry is the witness, so
/// what has been let in already has no more say than what waits.
class LoopHearing {
 public:
  /// Remembers in `state` which pairs agree.
  LoopHearing(const BackendConfig& config, SmootherState& state);

  [[nodiscard]] bool heard(std::int32_t number) const { return place(number).has_value(); }

  /// Belongs to the largest set of loops that agree with each other.
  [[nodiscard]] bool believed(std::int32_t number) const;
  [[nodiscard]] std::size_t believed_count() const { return believed_.size(); }

  /// Odometry pins the loop down by itself, or another believed loop does: one that is in the graph, or one from so far
  /// away that a place that merely looks alike would not explain both. The loop must have been heard.
  [[nodiscard]] bool supported(std::int32_t number) const;

  /// The loop, if the graph contradicts it, and the newest others of which that is so, as many as agree with it and
  /// one another.
  [[nodiscard]] std::vector<GraphLoop> challengers(std::int32_t number);

 private:
  [[nodiscard]] std::optional<std::size_t> place(std::int32_t number) const;
  [[nodiscard]] bool are_apart(const LoopClaim& a, const LoopClaim& b) const;
  /// Pairs with a loop that testifies no more are hardly ever asked for again.
  void forget_old_pairs(const std::vector<const GraphLoop*>& witnesses);
  bool agree(std::size_t i, std::size_t k);
  bool agree(const GraphLoop& a, const GraphLoop& b);
  void believe_largest_set();

  ConsistencyRule rule_;
  const BackendConfig& config_;
  SmootherState& state_;
  std::vector<std::int32_t> numbers_;  ///< of the loops that testify
  std::vector<LoopClaim> claims_;      ///< theirs
  std::vector<double> costs_;          ///< by which sets of one size differ
  std::vector<std::size_t> believed_;  ///< places in claims_, ascending
};

}  // namespace ignis
