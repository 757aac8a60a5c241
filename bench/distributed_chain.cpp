// SPDX-License-Identifier: Apache-2.0
#include "distributed_chain.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "backend/loops/loop_distribution.h"

namespace ignis::bench {

void DistributedChain::add(std::int32_t id, const Pose& T_odom_body) {
  poses_.push_back(poses_.empty() ? T_odom_body : poses_.back() * (newest_odometry_.inverse() * T_odom_body));
  ids_.push_back(id);
  newest_odometry_ = T_odom_body;
}

void DistributedChain::close(const LoopResult& loop) {
  const auto place = [this](std::int32_t id) {
    return static_cast<std::size_t>(std::ranges::lower_bound(ids_, id) - ids_.begin());
  };
  const ChainLoop closed{place(loop.to_id), place(loop.from_id), loop.T_to_from};
  if (std::optional<std::vector<Pose>> corrected = distribute_loop_correction(poses_, closed, max_correction_m_)) {
    poses_ = *std::move(corrected);
  }
}

}  // namespace ignis::bench
