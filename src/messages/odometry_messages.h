// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/measurements.h"
#include "common/nav_state.h"
#include "frontend/scan_stats.h"
#include "ignis/cloud_t.hpp"
#include "ignis/pose_t.hpp"
#include "ignis/scan_stats_t.hpp"
#include "ignis/state_t.hpp"
#include "messages/part_assembler.h"

/// LIO_STATE, SMOOTHED_STATE, LIO_SCAN_STATS, LIO_CLOUD and GROUND_TRUTH. Running numbers and measured times are the
/// sender's business: it sets `sequence` and `time_spent_ms` itself.
namespace ignis::messages {

/// `frame` is "odom" or "map"; the covariance (order of ErrorBlock) may be absent.
[[nodiscard]] state_t to_message(const NavState& state, std::int32_t session, const std::string& frame,
                                 const Matrix15d* covariance = nullptr);
[[nodiscard]] NavState from_message(const state_t& message);

[[nodiscard]] scan_stats_t to_message(const ScanStats& stats);
[[nodiscard]] ScanStats from_message(const scan_stats_t& message);

/// A deskewed scan in the body frame of its instant.
struct PosedCloud {
  Utime utime = 0;            ///< [us] end of the scan
  std::int32_t sequence = 0;  ///< +1 per cloud
  std::int32_t session = 0;   ///< +1 whenever the front end begins anew
  bool applied = false;       ///< the scan corrected the state
  Pose T_odom_body;
  std::vector<CloudPoint> points;
};

/// A cloud as one message, or as numbered parts when it does not fit one datagram.
[[nodiscard]] std::vector<cloud_t> to_messages(const PosedCloud& cloud);

/// Puts the parts of clouds together again.
class CloudAssembler {
 public:
  /// A complete cloud, or nothing yet.
  [[nodiscard]] std::optional<PosedCloud> add(const cloud_t& part);
  [[nodiscard]] std::int64_t incomplete() const { return parts_.incomplete(); }

 private:
  PartAssembler<cloud_t> parts_;
};

[[nodiscard]] pose_t ground_truth_message(Utime utime, const Pose& T_world_body, const Eigen::Vector3d& v_world);

}  // namespace ignis::messages
