// SPDX-License-Identifier: Apache-2.0
#include "live_agreement.h"

#include <algorithm>
#include <map>
#include <utility>

#include "channel_agreement.h"
#include "messages/length_check.h"
#include "messages/odometry_messages.h"

namespace ignis {
namespace {

using Key = std::pair<Utime, std::int32_t>;  // end of the scan, its running number

/// The message that the live front end would have sent for a replayed scan; number and time spent are the sender's.
scan_stats_t as_sent(const ScanStats& stats, const scan_stats_t& live) {
  scan_stats_t message = messages::to_message(stats);
  message.sequence = live.sequence;
  message.time_spent_ms = live.time_spent_ms;
  return message;
}

}  // namespace

LiveAgreement agreement_with_live(std::span<const std::span<const std::byte>> recorded,
                                  const std::vector<ScanStats>& replayed) {
  LiveAgreement agreement;
  std::map<Key, const ScanStats*> by_key;
  for (const ScanStats& stats : replayed) by_key[{stats.utime, stats.scan_sequence}] = &stats;
  if (by_key.empty()) return agreement;
  std::vector<scan_stats_t> live;
  for (const std::span<const std::byte> data : recorded) {
    scan_stats_t message;
    if (messages::decode_checked(data, message) && message.utime <= by_key.rbegin()->first.first) {
      live.push_back(std::move(message));
    }
  }
  std::ranges::stable_sort(live, {}, &scan_stats_t::sequence);
  for (const scan_stats_t& message : live) {
    if (agreement.recorded++ == 0) agreement.first_sequence = message.sequence;
    const auto found = by_key.find({message.utime, message.scan_sequence});
    const bool equal = found != by_key.end() && encoded(as_sent(*found->second, message)) == encoded(message);
    agreement.equal += equal ? 1 : 0;
    if (!equal && !agreement.first_unequal) agreement.first_unequal = message.utime;
    if (found != by_key.end()) {
      const ScanStats sent = messages::from_message(message);
      const double distance = (sent.T_odom_body.translation - found->second->T_odom_body.translation).norm();
      agreement.largest_distance_m = std::max(agreement.largest_distance_m, distance);
    }
  }
  return agreement;
}

}  // namespace ignis
