// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "backend/smoother_state.h"
#include "common/measurement_bytes.h"

/// What changed in a list of loops: a long drive has thousands, of which a keyframe touches a few.
namespace ignis {

/// Loops are known by their numbers. Applied in the order of the members. Factor ids are not kept: the solver gives new
/// ones.
struct LoopListChange {
  std::vector<std::int32_t> removed;
  std::vector<GraphLoop> altered;   ///< stay at their places
  std::vector<GraphLoop> appended;  ///< at the end
};

/// All that it removes or alters is in the list.
[[nodiscard]] bool fits(const LoopListChange& change, const std::vector<GraphLoop>& loops);

/// Requires fits().
void apply_to(std::vector<GraphLoop>& loops, LoopListChange change);

/// A list as it was when it was last looked at.
class LoopListMemory {
 public:
  /// What makes `loops` of it.
  [[nodiscard]] LoopListChange next(const std::vector<GraphLoop>& loops);

 private:
  struct Known {
    std::int32_t number = 0;
    std::vector<std::byte> bytes;
  };
  std::vector<Known> known_;
};

void transfer(auto& io, FieldsOf<LoopResult> auto& result) {
  io.number(result.utime);
  io.number(result.keyframes);
  io.number(result.candidates);
  io.number(result.passed);
  io.number(result.stage);
  io.number(result.reason);
  io.text(result.reason_text);
  io.number(result.from_id);
  io.number(result.to_id);
  io.number(result.correction_m);
  io.number(result.correction_rad);
  io.number(result.mean_residual);
  io.number(result.matched_fraction);
  io.number(result.overlap);
  io.number(result.chi_square);
  io.number(result.chi_square_bound);
  transfer(io, result.T_to_from);
}

void transfer(auto& io, FieldsOf<GraphLoop> auto& loop) {
  transfer(io, loop.result);
  io.matrix(loop.rows);
  io.number(loop.number);
  io.number(loop.entered_id);
  io.number(loop.is_contradicted);
}

void transfer(auto& io, FieldsOf<LoopListChange> auto& change) {
  io.list(change.removed);
  io.list(change.altered);
  io.list(change.appended);
}

}  // namespace ignis
