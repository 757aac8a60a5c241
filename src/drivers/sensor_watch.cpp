// SPDX-License-Identifier: Apache-2.0
#include "drivers/sensor_watch.h"

#include <algorithm>
#include <format>
#include <utility>

namespace ignis::l1 {

namespace {

constexpr Utime kStreamMissingUs = 250'000;
constexpr Utime kStandbyUs = 1'000'000;
constexpr Utime kPatienceUs = 1'000'000;
constexpr Utime kProbationUs = 1'000'000;
constexpr int kFrozenSamples = 25;
/// A second: at rest the steps of one of the two alone may be coarser than its noise.
constexpr int kHalfFrozenSamples = 250;
constexpr int kRejectedIsFault = 50;

}  // namespace

void SensorWatch::Activity::update(std::int64_t count, Utime now) {
  if (count == seen) return;
  seen = count;
  moved_at = now;
  ever = true;
}

SensorReport SensorWatch::look(Utime now, std::string_view closed_because, const DecoderCounters& counters,
                               const SensorHealth& health) {
  const bool connected = closed_because.empty();
  if (connected && !was_connected_) connected_at_ = now;
  was_connected_ = connected;
  bytes_.update(counters.framing.bytes, now);
  imu_.update(counters.imu_published, now);
  packets_.update(counters.pairing.paired, now);
  rejections_.update(counters.rejected_values, now);
  SensorReport report = judge(now, closed_because, health);
  if (report.severity != Severity::kOk) {
    trouble_at_ = now;
    trouble_ = report.text;
  } else if (!trouble_.empty() && now - trouble_at_ < kProbationUs) {
    report.severity = Severity::kDegraded;
    report.text = std::format("running again, but a moment ago: {}", trouble_);
  }
  return report;
}

SensorReport SensorWatch::judge(Utime now, std::string_view closed_because, const SensorHealth& health) const {
  if (!closed_because.empty()) {
    return {SensorState::kDisconnected, Severity::kFault, std::format("{}: {}; trying again", link_, closed_because)};
  }
  // What no longer comes is no longer wrong: it is missing.
  if (health.rejected_in_a_row >= kRejectedIsFault && !rejections_.quiet_for(now, kStreamMissingUs)) {
    return {SensorState::kRunning, Severity::kFault,
            std::format("{} frames in a row with impossible {}", health.rejected_in_a_row, health.rejected_field)};
  }
  if (imu_.quiet_for(now, kStreamMissingUs) && packets_.quiet_for(now, kStreamMissingUs)) return judge_silence(now);
  return judge_streams(now, health);
}

SensorReport SensorWatch::judge_silence(Utime now) const {
  const bool ever = imu_.ever || packets_.ever;
  const Utime since = ever ? std::max(imu_.moved_at, packets_.moved_at) : connected_at_;
  const Severity severity = now - since > kPatienceUs ? Severity::kFault : Severity::kDegraded;
  const SensorState state = ever ? SensorState::kSilent : SensorState::kWaiting;
  if (!bytes_.quiet_for(now, kStreamMissingUs)) {
    return {state, severity,
            std::format("{}: {} bytes so far, but {}: wrong speed, another device, or a damaged line", link_,
                        bytes_.seen, ever ? "no valid frame any more" : "no valid frame among them")};
  }
  return {state, severity,
          ever ? std::format("{}: the sensor has stopped sending after {} bytes", link_, bytes_.seen)
               : std::format("{}: no byte from the sensor yet; has it power?", link_)};
}

SensorReport SensorWatch::judge_streams(Utime now, const SensorHealth& health) const {
  const bool no_packets = packets_.quiet_for(now, kStreamMissingUs);
  if (imu_.quiet_for(now, kStreamMissingUs)) {
    return {SensorState::kRunning, Severity::kDegraded, "scans come, but no inertial data"};
  }
  if (no_packets && packets_.quiet_for(now, kStandbyUs)) {
    return {SensorState::kStandby, Severity::kDegraded, "inertial data only: standby, or the rotor is blocked"};
  }
  if (no_packets) return {SensorState::kRunning, Severity::kDegraded, "inertial data come, but no scans"};
  if (std::min(health.equal_gyro_samples, health.equal_accel_samples) >= kFrozenSamples) {
    return {SensorState::kRunning, Severity::kDegraded, "inertial values are frozen"};
  }
  if (health.equal_gyro_samples >= kHalfFrozenSamples) {
    return {SensorState::kRunning, Severity::kDegraded, "values of the gyro are frozen"};
  }
  if (health.equal_accel_samples >= kHalfFrozenSamples) {
    return {SensorState::kRunning, Severity::kDegraded, "values of the accelerometer are frozen"};
  }
  return {SensorState::kRunning, Severity::kOk, "running"};
}

}  // namespace ignis::l1
