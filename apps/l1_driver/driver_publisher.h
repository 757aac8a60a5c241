// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "drivers/l1_decoder.h"
#include "drivers/sensor_watch.h"
#include "runtime/lcm_link.h"

namespace ignis::runtime {

/// Puts what the decoder gives on the bus: L1_IMU, L1_SCAN, and once a second L1_STATUS and HEALTH.
class DriverPublisher {
 public:
  DriverPublisher(LcmLink& link, const l1::L1Decoder& decoder) : link_(link), decoder_(decoder) {}

  void publish(const l1::Event& event);

  /// Looks at the sensor; publishes when a second has passed or its state has changed. `now`: any steady clock [us].
  void report(Utime now, bool connected);

 private:
  void publish_status(const l1::SensorReport& report);

  LcmLink& link_;
  const l1::L1Decoder& decoder_;
  l1::SensorWatch watch_;
  Utime last_status_ = 0;
  std::string last_text_;
  std::int32_t status_sequence_ = 0;
};

}  // namespace ignis::runtime
