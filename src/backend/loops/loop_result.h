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
  kTooLittleOverlap = 11,
  kContradictsOdometry = 12,
  kContradictsLoops = 13,
  kNeedsSupport = 14,
  kKept = 15,
  kVetoed = 16,
  kCloudLost = 17,
  kContradictsGraph = 18,
};

/// How far a loop has come. The numbers are those of loop_result_t.
enum class LoopStage : std::int8_t {
  kNone = 0,       ///< nobody to close a loop with
  kCandidate = 1,  ///< near enough, but not confirmed
  kVerified = 2,   ///< confirmed by the match; waits outside of the graph
  kOnTrial = 3,    ///< in the graph
  kKept = 4,       ///< in the graph, and nothing has contradicted it for some keyframes
  kWithdrawn = 5,  ///< taken out of the graph; where loops contradict it, it waits again
};

/// The reason and the stage in words.
[[nodiscard]] const char* text(LoopReason reason);
[[nodiscard]] const char* text(LoopStage stage);

/// What one keyframe's search for a loop found, or what became of an earlier loop. The reason is kAccepted exactly when
/// the loop has just entered the graph and kWithdrawn exactly when it has just left it.
struct LoopResult {
  Utime utime = 0;     ///< [us] of the keyframe that looked
  int keyframes = 0;   ///< keyframes in the graph
  int candidates = 0;  ///< earlier keyframes that passed the geometric test
  int passed = 0;      ///< of those tried, confirmed by the scan match
  LoopStage stage = LoopStage::kNone;
  LoopReason reason = LoopReason::kNoCandidate;
  std::string reason_text;        ///< with the figures that decided
  int from_id = -1;               ///< keyframe that looked
  int to_id = -1;                 ///< earlier keyframe
  double correction_m = 0.0;      ///< translation between the graph's prediction and the match
  double correction_rad = 0.0;    ///< rotation of the same
  double mean_residual = 0.0;     ///< [m] mean absolute point-to-plane distance after the match
  double matched_fraction = 0.0;  ///< points with a plane over points tried
  double overlap = 0.0;           ///< the other way round: surfaces shown over surfaces that would be shown
  double chi_square = 0.0;        ///< of the test that decided last, and what it allows; 0 when none was made
  double chi_square_bound = 0.0;
  Pose T_to_from;  ///< as matched

  [[nodiscard]] bool accepted() const { return reason == LoopReason::kAccepted; }
};

}  // namespace ignis
