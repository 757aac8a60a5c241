// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "backend/loops/loop_result.h"
#include "common/pose.h"

namespace ignis::bench {

/// What the reference makes of the same loops: no graph, but a chain of odometry whose loops are spread over the
/// keyframes between their ends (loop_distribution.h). The baseline that a graph has to beat.
class DistributedChain {
 public:
  /// `max_correction_m`: loops that ask for more are left out, as the reference does.
  explicit DistributedChain(double max_correction_m) : max_correction_m_(max_correction_m) {}

  /// Ids ascend.
  void add(std::int32_t id, const Pose& T_odom_body);

  /// A loop that entered the graph. It is never taken out again.
  void close(const LoopResult& loop);

  [[nodiscard]] const std::vector<Pose>& poses() const { return poses_; }

 private:
  double max_correction_m_;
  std::vector<std::int32_t> ids_;
  std::vector<Pose> poses_;
  Pose newest_odometry_;
};

}  // namespace ignis::bench
