// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <Eigen/Core>

#include "common/pose.h"
#include "common/time.h"

namespace ignis {

/// Why a scan did or did not correct the state. Values and order are those of lcmtypes/scan_stats_t.lcm.
enum class ScanReason : std::int8_t {
  kApplied = 0,
  kNotInitialised = 1,
  kTooFewPoints = 2,
  kTooFewMatches = 3,
  kInnovationTooLarge = 4,
  kUnobservable = 5,
  kCorrectionTooLarge = 6,
  kVelocityCorrectionTooLarge = 7,
  kMatchingDisabled = 8,
  kMapEmpty = 9,
  kBadStamp = 10,
  kNoImu = 11,
  kNumericalFailure = 12,
  kTooOften = 13,
  kSessionEnded = 14,
  kBehind = 15,
};

/// The reason in words.
[[nodiscard]] std::string_view text(ScanReason reason);

/// True for reasons that say: this scan and the map (or the prediction) contradict each other.
[[nodiscard]] bool is_contradiction(ScanReason reason);

/// What the front end did with one scan.
struct ScanStats {
  Utime utime = 0;  ///< [us] end of the scan
  std::int32_t scan_sequence = 0;
  std::int32_t session = 0;  ///< +1 whenever the front end begins anew
  ScanReason reason = ScanReason::kNotInitialised;
  int points = 0;                    ///< after the range filter
  int unread = 0;                    ///< points of a scan that is far too large that were not looked at
  int matched = 0;                   ///< points that found a plane, without what is new or moves
  int used = 0;                      ///< of these, inside the Mahalanobis gate in the last pass
  double mean_innovation = 0.0;      ///< [m] mean absolute distance at the predicted pose
  double mean_residual = 0.0;        ///< [m] the same at the corrected pose
  double correction_m = 0.0;         ///< [m] applied or, when refused by the trust region, asked for
  double correction_rad = 0.0;       ///< [rad]
  double velocity_correction = 0.0;  ///< [m/s]
  Eigen::Vector3d observability = Eigen::Vector3d::Zero();  ///< diagonal of sum(n n^T) over its trace, world axes
  int degenerate_directions = 0;                            ///< eigen-directions left to the IMU
  /// Normalised innovation squared of the scan, in the directions that it observes; nis_directions on average.
  double nis = 0.0;
  int nis_directions = 0;
  bool standing = false;          ///< the vehicle stands
  bool of_one_instant = false;    ///< all of its points are: within the scan nothing was deskewed
  double imu_disagreement = 0.0;  ///< [sigma] by which scans and IMU disagree about the last two seconds
  /// These directions in words, see describe(), and why the place is doubtful, see reacquire().
  std::string unobserved;
  Pose T_odom_body;    ///< after this scan
  int map_points = 0;  ///< in the local map, after this scan

  [[nodiscard]] bool applied() const { return reason == ScanReason::kApplied; }
};

/// The reason in words, and which directions the scan left open.
[[nodiscard]] std::string explanation(const ScanStats& stats);

}  // namespace ignis
