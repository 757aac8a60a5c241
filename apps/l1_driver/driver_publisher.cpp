// SPDX-License-Identifier: Apache-2.0
#include "driver_publisher.h"

#include <utility>

#include "ignis/driver_status_t.hpp"
#include "ignis/health_t.hpp"
#include "messages/sensor_messages.h"
#include "runtime/channels.h"

namespace ignis::runtime {

void DriverPublisher::publish(const l1::Event& event) {
  if (const auto* sample = std::get_if<ImuSample>(&event)) {
    link_.publish(channels::kImu, messages::to_message(*sample, decoder_.housekeeping().imu_temperature));
    return;
  }
  for (const scan_t& part : messages::to_messages(std::get<Scan>(event))) link_.publish(channels::kScan, part);
}

void DriverPublisher::report(Utime now, bool connected) {
  const l1::SensorReport report = watch_.look(now, connected, decoder_.counters(), decoder_.health());
  link_.report_health(decoder_.newest_utime(), report.degraded ? health_t::DEGRADED : health_t::OK, report.text);
  if (now - last_status_ < kMicrosPerSecond && report.text == last_text_) return;
  last_status_ = now;
  last_text_ = report.text;
  publish_status(report);
}

void DriverPublisher::publish_status(const l1::SensorReport& report) {
  const l1::DecoderCounters counters = decoder_.counters();
  const l1::Housekeeping& housekeeping = decoder_.housekeeping();
  driver_status_t status;
  status.utime = decoder_.newest_utime();
  status.sequence = status_sequence_++;
  status.state = std::to_underlying(report.state);
  status.state_text = report.text;
  status.bytes = counters.framing.bytes;
  status.frames = counters.framing.frames;
  status.crc_errors = counters.framing.crc_errors;
  status.skipped_bytes = counters.framing.skipped_bytes;
  status.resyncs = counters.framing.resyncs;
  status.unknown_messages = counters.unknown_messages;
  status.rejected_values = counters.rejected_values;
  status.scans_paired = counters.pairing.paired;
  status.scans_unpaired = counters.pairing.unpaired;
  status.duplicates = counters.duplicates;
  status.scan_gaps = counters.scan_gaps;
  status.imu_gaps = counters.imu_gaps;
  status.imu_published = counters.imu_published;
  status.scans_published = counters.scans_published;
  status.points_published = counters.points_published;
  status.points_filtered = counters.points_filtered;
  status.clock_offset_us = decoder_.clock().offset_us();
  status.clock_drift_ppm = decoder_.clock().drift_ppm();
  status.clock_jitter_us = decoder_.clock().jitter_us();
  status.apd_temperature = housekeeping.apd_temperature;
  status.imu_temperature = housekeeping.imu_temperature;
  status.dirty_index = housekeeping.dirty_index;
  status.work_status = housekeeping.work_status;
  status.work_status_text = l1::work_status_text(housekeeping.work_status);
  status.firmware = housekeeping.firmware;
  link_.publish(channels::kDriverStatus, status);
}

}  // namespace ignis::runtime
