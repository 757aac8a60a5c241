// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "common/time.h"
#include "drivers/l1_decoder.h"

namespace ignis::l1 {

/// The values are those of driver_status_t.
enum class SensorState : std::int8_t { kWaiting = 0, kRunning = 1, kStandby = 2, kSilent = 3, kDisconnected = 4 };

/// How far the data can be used.
enum class Severity : std::uint8_t {
  kOk,
  kDegraded,  ///< a stream is missing or cannot be believed
  kFault,     ///< nothing usable comes: a person has to look
};

struct SensorReport {
  SensorState state = SensorState::kWaiting;
  Severity severity = Severity::kOk;
  std::string text;  ///< the state and its reason in words
};

/// Judges the sensor by what the decoder counted. The caller's clock [us] comes in with each look, at least every 100
/// ms. After trouble a second of good data is asked for before all is well again.
class SensorWatch {
 public:
  /// `link`: the port in words, such as "/dev/ttyUSB0 at 2000000 baud".
  explicit SensorWatch(std::string link) : link_(std::move(link)) {}

  /// `closed_because`: why the port is not open; empty while it is. Returns the judgement as of `now`.
  [[nodiscard]] SensorReport look(Utime now, std::string_view closed_because, const DecoderCounters& counters,
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
  [[nodiscard]] SensorReport judge(Utime now, std::string_view closed_because, const SensorHealth& health) const;
  [[nodiscard]] SensorReport judge_silence(Utime now) const;
  [[nodiscard]] SensorReport judge_streams(Utime now, const SensorHealth& health) const;

  std::string link_;
  Activity bytes_;
  Activity imu_;
  Activity packets_;
  Activity rejections_;
  Utime connected_at_ = 0;
  bool was_connected_ = false;
  Utime trouble_at_ = 0;
  std::string trouble_;
};

}  // namespace ignis::l1
