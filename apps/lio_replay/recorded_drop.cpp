// SPDX-License-Identifier: Apache-2.0
#include "recorded_drop.h"

#include <format>

#include "runtime/channels.h"

namespace ignis {

std::string loss_in(const health_t& health) {
  std::string what;
  if (health.process != "lio_frontend") return what;
  for (std::size_t i = 0; i < health.channels.size(); ++i) {
    const std::int64_t missed = health.lost[i] + health.rejected[i] + health.queue_drops[i];
    const std::string& channel = health.channels[i];
    if (missed == 0 || (channel != runtime::channels::kImu && channel != runtime::channels::kScan)) continue;
    what += std::format("{}the live lio_frontend missed {} messages of {}", what.empty() ? "" : ", ", missed, channel);
  }
  return what;
}

}  // namespace ignis
