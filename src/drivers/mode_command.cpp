// SPDX-License-Identifier: Apache-2.0
#include "drivers/mode_command.h"

namespace ignis::l1 {

namespace {

constexpr Utime kRepeatUs = 100'000;
constexpr Utime kGiveUpUs = 10'000'000;
constexpr Utime kStandbyQuietUs = 1'000'000;
/// A tenth of a second of packets: the rotor runs.
constexpr std::int64_t kRunningPackets = 18;

}  // namespace

ModeCommand::ModeCommand(WorkingMode wanted, const StreamCounters& counters, Utime now)
    : wanted_(wanted),
      began_(now),
      packet_at_(now),
      packets_seen_(counters.pairing.paired),
      frames_at_packet_(counters.framing.frames),
      frames_(counters.framing.frames) {}

ModeCommand::Step ModeCommand::step(const StreamCounters& counters, Utime now) {
  frames_ = counters.framing.frames;
  if (counters.pairing.paired != packets_seen_) {
    packets_since_ += counters.pairing.paired - packets_seen_;
    packets_seen_ = counters.pairing.paired;
    packet_at_ = now;
    frames_at_packet_ = frames_;
  }
  if (sent_ > 0 && confirmed(now)) return Step::kConfirmed;
  if (now - began_ > kGiveUpUs) return Step::kFailed;
  if (sent_ > 0 && now - last_sent_ < kRepeatUs) return Step::kWait;
  last_sent_ = now;
  ++sent_;
  return Step::kSend;
}

bool ModeCommand::confirmed(Utime now) const {
  if (wanted_ == WorkingMode::kNormal) return packets_since_ >= kRunningPackets;
  return now - packet_at_ >= kStandbyQuietUs && frames_ > frames_at_packet_;
}

}  // namespace ignis::l1
