// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/l1_decoder.h"

namespace ignis::l1 {

/// The values are those of driver_status_t.
enum class SensorState : std::int8_t { kWaiting = 0, kRunning = 1, kStandby = 2, kSilent = 3, kDisconnected = 4 };

struct SensorReport {
  SensorState state = SensorState::kWaiting;
  bool degraded = false;  ///< connected, but a stream is missing or cannot be believed
  std::string text;       ///< the state and its reason in words
};

/// Judges the sensor by what the decoder counted. The caller's clock [us] comes in with each look, at least every 100
/// ms.
class SensorWatch {
 public:
  /// `connected`: the port is open. Returns the judgement as of `now`.
  [[nodiscard]] SensorReport look(Utime now, bool connected, const DecoderCounters& counters,
                                  const SensorHealth& health);

 private:
  /// When a counter last moved.
  struct Activity {
    std::int64_t seen = 0;
    Utime moved_at = 0;
    bool ever = false;
    void update(std::int64_t count, Utime now);
    [[nodiscard]] bool quiet_for(Utime now, Utime duration) const { return !ever || now - moved_at > duration; }
  };
  [[nodiscard]] SensorReport judge_streams(Utime now, const SensorHealth& health) const;

  Activity imu_;
  Activity packets_;
};

}  // namespace ignis::l1
