// SPDX-License-Identifier: Apache-2.0
#include "drivers/packet_pairer.h"

#include <utility>

namespace ignis::l1 {

namespace {

/// In the 6 ms to the next AUX at most two inertial frames, a version and a time-sync frame can come.
constexpr int kMostFramesBetween = 5;
/// A stalled host may split a pair over two reads; beyond this, the link itself was down.
constexpr double kMostAgeUs = 100'000.0;

}  // namespace

void PacketPairer::on_auxiliary(const Auxiliary& auxiliary, double at_us) {
  if (waiting_) ++counters_.unpaired;
  waiting_ = auxiliary;
  waiting_since_us_ = at_us;
  frames_since_auxiliary_ = 0;
}

std::optional<PacketPair> PacketPairer::on_distance(const Distance& distance, double at_us) {
  const std::optional<Auxiliary> auxiliary = std::exchange(waiting_, std::nullopt);
  if (auxiliary && auxiliary->packet_id == distance.packet_id && is_fresh(at_us)) {
    ++counters_.paired;
    last_paired_id_ = distance.packet_id;
    return PacketPair{*auxiliary, distance};
  }
  if (auxiliary) ++counters_.unpaired;
  if (!auxiliary && last_paired_id_ == distance.packet_id) {
    ++counters_.duplicates;
  } else {
    ++counters_.unpaired;
  }
  return std::nullopt;
}

bool PacketPairer::is_fresh(double at_us) const {
  return frames_since_auxiliary_ <= kMostFramesBetween && at_us - waiting_since_us_ <= kMostAgeUs;
}

}  // namespace ignis::l1
