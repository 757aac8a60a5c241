// SPDX-License-Identifier: Apache-2.0
#include "driver_publisher.h"

#include <limits>
#include <utility>

#include "ignis/driver_status_t.hpp"
#include "ignis/health_t.hpp"
#include "messages/sensor_messages.h"
#include "runtime/channels.h"
#include "runtime/steady_time.h"

namespace ignis::runtime {
namespace {

constexpr std::int64_t kMaxEpoch = std::numeric_limits<std::int32_t>::max();

}  // namespace

std::int32_t epoch_of_start() { return static_cast<std::int32_t>(steady_now() / 1000 & kMaxEpoch); }

void DriverPublisher::publish(const l1::Event& event) {
  if (const auto* sample = std::get_if<ImuSample>(&event)) {
    bus_.publish(channels::kImu, messages::to_message(*sample, decoder_.housekeeping().imu_temperature));
    return;
  }
  for (const scan_t& part : messages::to_messages(std::get<Scan>(event))) bus_.publish(channels::kScan, part);
}

void DriverPublisher::report(Utime now, const LinkReport& link) {
  const l1::SensorReport sensor = watch_.look(now, link.closed_because, decoder_.counters(), decoder_.health());
  report_health(sensor, link);
  // On change of the judgement, not of its figures: a line that stays bad must not flood the bus.
  const bool changed = sensor.state != last_state_ || sensor.severity != last_severity_;
  if (now - last_status_ < kMicrosPerSecond && !changed) return;
  last_status_ = now;
  last_state_ = sensor.state;
  last_severity_ = sensor.severity;
  publish_status(sensor, link);
}

void DriverPublisher::report_health(const l1::SensorReport& sensor, const LinkReport& link) {
  std::int8_t state = health_t::OK;
  if (sensor.severity == l1::Severity::kDegraded || !link.trouble.empty()) state = health_t::DEGRADED;
  if (sensor.severity == l1::Severity::kFault) state = health_t::FAULT;
  const std::string text = link.trouble.empty() ? sensor.text : sensor.text + "; " + link.trouble;
  bus_.report_health(decoder_.newest_utime(), state, text);
}

void DriverPublisher::publish_status(const l1::SensorReport& report, const LinkReport& link) {
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
  status.foreign_datagrams = link.refused;
  status.clock_epoch = static_cast<std::int32_t>((first_epoch_ + counters.clock_restarts) & kMaxEpoch);
  status.sensor_time_s = housekeeping.sensor_time_s;
  status.clock_offset_us = decoder_.clock().offset_us();
  status.clock_drift_ppm = decoder_.clock().drift_ppm();
  status.clock_jitter_us = decoder_.clock().jitter_us();
  status.apd_temperature = housekeeping.apd_temperature;
  status.imu_temperature = housekeeping.imu_temperature;
  status.dirty_index = housekeeping.dirty_index;
  status.work_status = housekeeping.work_status;
  status.work_status_text = l1::work_status_text(housekeeping.work_status);
  status.firmware = housekeeping.firmware;
  bus_.publish(channels::kDriverStatus, status);
}

}  // namespace ignis::runtime
