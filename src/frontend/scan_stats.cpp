// SPDX-License-Identifier: Apache-2.0
#include "frontend/scan_stats.h"

namespace ignis {

std::string_view text(ScanReason reason) {
  switch (reason) {
    case ScanReason::kApplied:
      return "applied";
    case ScanReason::kNotInitialised:
      return "not initialised yet";
    case ScanReason::kTooFewPoints:
      return "too few points in range";
    case ScanReason::kTooFewMatches:
      return "too few points found a plane";
    case ScanReason::kInnovationTooLarge:
      return "mean point-to-plane distance too large";
    case ScanReason::kUnobservable:
      return "no direction is observable";
    case ScanReason::kCorrectionTooLarge:
      return "position correction outside the trust region";
    case ScanReason::kVelocityCorrectionTooLarge:
      return "velocity correction outside the trust region";
    case ScanReason::kMatchingDisabled:
      return "scan matching is switched off";
    case ScanReason::kMapEmpty:
      return "local map is empty";
    case ScanReason::kBadStamp:
      return "stamp out of order or too old";
    case ScanReason::kNoImu:
      return "no IMU data cover the scan";
    case ScanReason::kNumericalFailure:
      return "numerical failure";
    case ScanReason::kTooOften:
      return "overlaps the scan before it, or came too soon after it";
    case ScanReason::kSessionEnded:
      return "its session was ended by a command";
    case ScanReason::kBehind:
      return "left out: more scans come than this computer has time for";
  }
  return "unknown reason";
}

bool is_contradiction(ScanReason reason) {
  return reason == ScanReason::kInnovationTooLarge || reason == ScanReason::kCorrectionTooLarge ||
         reason == ScanReason::kVelocityCorrectionTooLarge || reason == ScanReason::kNumericalFailure;
}

std::string explanation(const ScanStats& stats) {
  std::string words(text(stats.reason));
  if (stats.of_one_instant) words += "; not deskewed, its points are all of one instant";
  if (stats.unread > 0) words += "; " + std::to_string(stats.unread) + " points too many, which were not looked at";
  if (!stats.unobserved.empty()) words += "; not observed: " + stats.unobserved;
  return words;
}

}  // namespace ignis
