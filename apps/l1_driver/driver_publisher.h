// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/l1_decoder.h"
#include "drivers/sensor_watch.h"
#include "runtime/lcm_link.h"

namespace ignis::runtime {

/// How the driver's own surroundings are.
struct LinkReport {
  std::string closed_because = {};  ///< empty while the port is open
  std::int64_t refused = 0;         ///< deliveries from strangers
  std::string trouble = {};         ///< of the recording; empty: none
};

/// The first clock epoch of a live driver: its start [ms]. The sensor's counters start anew far less often than that
/// counts, so the successor of a killed driver repeats none of its epochs.
[[nodiscard]] std::int32_t epoch_of_start();

/// Puts what the decoder gives on the bus: L1_IMU, L1_SCAN, and once a second L1_STATUS and HEALTH.
class DriverPublisher {
 public:
  /// `source`: the port or file in words. `first_epoch`: of the stamps' clock, counted up from there.
  DriverPublisher(LcmLink& bus, const l1::L1Decoder& decoder, std::string source, std::int32_t first_epoch)
      : bus_(bus), decoder_(decoder), watch_(std::move(source)), first_epoch_(first_epoch) {}

  void publish(const l1::Event& event);

  /// Looks at the sensor; publishes when a second has passed or its state has changed. `now`: any steady clock [us].
  void report(Utime now, const LinkReport& link);

 private:
  void report_health(const l1::SensorReport& sensor, const LinkReport& link);
  void publish_status(const l1::SensorReport& report, const LinkReport& link);

  LcmLink& bus_;
  const l1::L1Decoder& decoder_;
  l1::SensorWatch watch_;
  std::int32_t first_epoch_;
  Utime last_status_ = 0;
  l1::SensorState last_state_ = l1::SensorState::kWaiting;
  l1::Severity last_severity_ = l1::Severity::kOk;
  std::int32_t status_sequence_ = 0;
};

}  // namespace ignis::runtime
