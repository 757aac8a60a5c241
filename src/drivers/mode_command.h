// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/time.h"
#include "drivers/l1_messages.h"
#include "drivers/packet_stream.h"

namespace ignis::l1 {

/// Brings the sensor into a working mode. There is no acknowledgement and single commands get lost, so the command is
/// repeated every 100 ms until the stream shows its effect: normal is packets coming, standby is a second of inertial
/// samples without any packet. Ten seconds without effect is a failure.
class ModeCommand {
 public:
  enum class Step : std::uint8_t { kWait, kSend, kConfirmed, kFailed };

  /// `counters`: of the stream so far, `now`: any steady clock [us].
  ModeCommand(WorkingMode wanted, const StreamCounters& counters, Utime now);

  /// What to do now. Call at least every 50 ms.
  [[nodiscard]] Step step(const StreamCounters& counters, Utime now);

  [[nodiscard]] int sent() const { return sent_; }

 private:
  [[nodiscard]] bool confirmed(Utime now) const;

  WorkingMode wanted_;
  Utime began_;
  Utime packet_at_;
  Utime last_sent_ = 0;
  std::int64_t packets_seen_;
  std::int64_t packets_since_ = 0;
  std::int64_t frames_at_packet_;
  std::int64_t frames_ = 0;
  int sent_ = 0;
};

}  // namespace ignis::l1
