// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_result.h"

namespace ignis {

const char* text(LoopReason reason) {
  switch (reason) {
    case LoopReason::kAccepted:
      return "accepted";
    case LoopReason::kNoCandidate:
      return "no candidate";
    case LoopReason::kTooFewMatched:
      return "too few points matched";
    case LoopReason::kResidualTooLarge:
      return "residual too large";
    case LoopReason::kCorrectionTooLarge:
      return "correction too large";
    case LoopReason::kDegenerate:
      return "geometry degenerate";
    case LoopReason::kDisabled:
      return "loop closing disabled";
    case LoopReason::kSolverRefused:
      return "solver refused the factor";
    case LoopReason::kWithdrawn:
      return "withdrawn: contradicts the rest of the graph";
    case LoopReason::kDidNotConverge:
      return "match did not converge";
    case LoopReason::kTooSoon:
      return "too soon after the last loop";
    case LoopReason::kTooLittleOverlap:
      return "too little overlap";
    case LoopReason::kContradictsOdometry:
      return "contradicts the odometry";
    case LoopReason::kContradictsLoops:
      return "contradicts other loops";
    case LoopReason::kNeedsSupport:
      return "waits for a second loop that agrees, at another place";
    case LoopReason::kKept:
      return "kept";
    case LoopReason::kVetoed:
      return "vetoed";
    case LoopReason::kContradictsGraph:
      return "contradicts the graph";
    case LoopReason::kCloudLost:
      return "the candidate's cloud is lost";
  }
  return "unknown";
}

const char* text(LoopStage stage) {
  switch (stage) {
    case LoopStage::kNone:
      return "none";
    case LoopStage::kCandidate:
      return "candidate";
    case LoopStage::kVerified:
      return "verified";
    case LoopStage::kOnTrial:
      return "on trial";
    case LoopStage::kKept:
      return "kept";
    case LoopStage::kWithdrawn:
      return "withdrawn";
  }
  return "unknown";
}

}  // namespace ignis
