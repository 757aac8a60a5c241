// SPDX-License-Identifier: Apache-2.0
#include "drivers/sensor_watch.h"

#include <format>
#include <utility>

namespace ignis::l1 {

namespace {

constexpr Utime kStreamMissingUs = 250'000;
constexpr Utime kStandbyUs = 1'000'000;
constexpr int kFrozenSamples = 25;
constexpr int kRejectedIsFault = 50;

}  // namespace

void SensorWatch::Activity::update(std::int64_t count, Utime now) {
  if (count == seen) return;
  seen = count;
  moved_at = now;
  ever = true;
}

SensorReport SensorWatch::look(Utime now, bool connected, const DecoderCounters& counters, const SensorHealth& health) {
  imu_.update(counters.imu_published, now);
  packets_.update(counters.pairing.paired, now);
  if (!connected) return {SensorState::kDisconnected, true, "port is not open, trying again"};
  if (health.rejected_in_a_row >= kRejectedIsFault) {
    return {SensorState::kRunning, true,
            std::format("{} frames in a row with impossible {}", health.rejected_in_a_row, health.rejected_field)};
  }
  return judge_streams(now, health);
}

SensorReport SensorWatch::judge_streams(Utime now, const SensorHealth& health) const {
  const bool no_imu = imu_.quiet_for(now, kStreamMissingUs);
  const bool no_packets = packets_.quiet_for(now, kStreamMissingUs);
  if (no_imu && no_packets) {
    if (!imu_.ever && !packets_.ever) return {SensorState::kWaiting, true, "no valid frame from the sensor yet"};
    return {SensorState::kSilent, true, "the sensor has stopped sending"};
  }
  if (no_imu) return {SensorState::kRunning, true, "scans come, but no inertial data"};
  if (no_packets && packets_.quiet_for(now, kStandbyUs)) {
    return {SensorState::kStandby, true, "inertial data only: standby, or the rotor is blocked"};
  }
  if (no_packets) return {SensorState::kRunning, true, "inertial data come, but no scans"};
  if (health.equal_imu_samples >= kFrozenSamples) return {SensorState::kRunning, true, "inertial values are frozen"};
  return {SensorState::kRunning, false, "running"};
}

}  // namespace ignis::l1
