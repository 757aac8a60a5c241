// SPDX-License-Identifier: Apache-2.0
#include "recorded_drop.h"

#include <algorithm>
#include <format>
#include <limits>

#include "runtime/channels.h"

namespace ignis {
namespace {

/// Of a count in a log, which may be any number: one that adds up with two others.
std::int64_t sound(std::int64_t count) {
  return std::clamp<std::int64_t>(count, 0, std::numeric_limits<std::int64_t>::max() / 3);
}

}  // namespace

std::string loss_in(const health_t& health) {
  std::string what;
  if (health.process != "lio_frontend") return what;
  for (std::size_t i = 0; i < health.channels.size(); ++i) {
    const std::int64_t missed = sound(health.lost[i]) + sound(health.rejected[i]) + sound(health.queue_drops[i]);
    const std::string& channel = health.channels[i];
    if (missed == 0 || (channel != runtime::channels::kImu && channel != runtime::channels::kScan)) continue;
    what += std::format("{}the live lio_frontend missed {} messages of {}", what.empty() ? "" : ", ", missed, channel);
  }
  return what;
}

}  // namespace ignis
