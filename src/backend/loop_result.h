// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "common/pose.h"
#include "common/time.h"

namespace ignis {

/// Outcome of a pass of the loop closer. The numbers are those of loop_result_t.
enum class LoopReason : std::int8_t {
  kAccepted = 0,
  kNoCandidate = 1,
  kTooFewMatched = 2,
  kResidualTooLarge = 3,
  kCorrectionTooLarge = 4,
  kDegenerate = 5,
  kDisabled = 6,
  kSolverRefused = 7,
  kWithdrawn = 8,
  kDidNotConverge = 9,
  kTooSoon = 10,
};

/// The reason in words.
[[nodiscard]] const char* text(LoopReason reason);

/// What one keyframe's search for a loop found, or what became of an earlier loop (kWithdrawn).
struct LoopResult {
  Utime utime = 0;     ///< [us] of the keyframe that looked
  int keyframes = 0;   ///< keyframes in the graph
  int candidates = 0;  ///< earlier keyframes that passed the geometric test
  int passed = 0;      ///< of those tried, confirmed by the scan match
  LoopReason reason = LoopReason::kNoCandidate;
  std::string reason_text;        ///< with the figures that decided
  int from_id = -1;               ///< keyframe that looked
  int to_id = -1;                 ///< earlier keyframe
  double correction_m = 0.0;      ///< translation between the graph's prediction and the match
  double correction_rad = 0.0;    ///< rotation of the same
  double mean_residual = 0.0;     ///< [m] mean absolute point-to-plane distance after the match
  double matched_fraction = 0.0;  ///< points with a plane over points tried
  Pose T_to_from;                 ///< as matched

  [[nodiscard]] bool accepted() const { return reason == LoopReason::kAccepted; }
};

}  // namespace ignis
