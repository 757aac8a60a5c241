// SPDX-License-Identifier: Apache-2.0
#include "drivers/packet_stream.h"

#include <algorithm>
#include <cmath>
#include <format>
#include <utility>

#include "drivers/value_checks.h"

namespace ignis::l1 {

namespace {

/// Late arrivals stretch what a counter may have moved; without arrivals only the counters themselves tell.
constexpr double kArrivalSlackUs = 1e6;
constexpr double kCounterSlackUs = 60e6;
/// A counter whose step had to be guessed over more than this has lost its phase.
constexpr double kPhaseLostUs = 200'000.0;
/// The sensor's own time is not trusted for stamps, but a leap of it tells that the sensor started anew.
constexpr double kSensorTimeLeapS = 0.5;

}  // namespace

std::string damage_in(const StreamCounters& counters) {
  const bool is_damaged = counters.framing.crc_errors + counters.framing.skipped_bytes + counters.scan_gaps +
                              counters.imu_gaps + counters.duplicates + counters.rejected_values >
                          0;
  if (!is_damaged) return {};
  return std::format(
      "damage in the stream: {} checksum errors, {} bytes outside frames, {} pairs and {} inertial samples missing, {} "
      "halves without partner, {} repeats, {} frames with impossible values",
      counters.framing.crc_errors, counters.framing.skipped_bytes, counters.scan_gaps, counters.imu_gaps,
      counters.pairing.unpaired, counters.duplicates, counters.rejected_values);
}

PacketStream::PacketStream(const DriverConfig& config)
    : config_(config), scans_(kScanPeriodUs), samples_(kImuPeriodUs) {}

std::vector<Packet> PacketStream::feed(std::span<const std::byte> bytes, Utime arrival) {
  parser_.feed(bytes, arrival);
  return drain();
}

std::vector<Packet> PacketStream::finish() {
  parser_.finish();
  return drain();
}

std::vector<Packet> PacketStream::drain() {
  while (const auto frame = parser_.next()) handle(*frame);
  return std::exchange(packets_, {});
}

StreamCounters PacketStream::counters() const {
  StreamCounters counters = counters_;
  counters.framing = parser_.counters();
  counters.pairing = pairer_.counters();
  counters.duplicates += counters.pairing.duplicates;
  return counters;
}

SensorHealth PacketStream::health() const {
  const Rejections worst =
      std::ranges::max({auxiliaries_rejected_, distances_rejected_, samples_rejected_}, {}, &Rejections::in_a_row);
  return {.rejected_in_a_row = worst.in_a_row,
          .rejected_field = std::string(worst.field),
          .equal_gyro_samples = equal_gyro_samples_,
          .equal_accel_samples = equal_accel_samples_};
}

void PacketStream::handle(const Frame& frame) {
  pairer_.on_frame();
  switch (frame.id) {
    case kAuxiliaryId:
      return handle(decode_auxiliary(frame.payload), frame.sent_before);
    case kDistanceId:
      return handle(decode_distance(frame.payload), frame.sent_before);
    case kImuId:
      return handle(decode_imu(frame.payload), frame.sent_before);
    case kTimeSyncId:
      packets_.emplace_back(decode_time_sync(frame.payload));
      return;
    case kVersionId: {
      Version version = decode_version(frame.payload);
      housekeeping_.firmware = version.sys_soft;
      packets_.emplace_back(std::move(version));
      return;
    }
    default:
      ++counters_.unknown_messages;
  }
}

void PacketStream::handle(const Auxiliary& message, double sent_before) {
  if (!accept(fault_in(message, config_), auxiliaries_rejected_)) return;
  housekeeping_.apd_temperature = message.apd_temperature;
  housekeeping_.imu_temperature = message.imu_temperature;
  housekeeping_.dirty_index = message.dirty_index;
  housekeeping_.work_status = message.work_status;

  const bool first = !scans_.unwrapper.last_id();
  const std::int64_t step = advance(scans_, samples_, message.packet_id, sent_before);
  note_sensor_time(message, step);
  packets_.emplace_back(AuxiliarySeen{scans_.unwrapper.count(), sent_before, step > 0 || first});
  pairer_.on_auxiliary(message, sent_before);
}

void PacketStream::handle(const Distance& message, double sent_before) {
  if (!accept(fault_in(message, config_), distances_rejected_)) return;
  auto pair = pairer_.on_distance(message, sent_before);
  if (!pair) return;
  const std::int64_t count = scans_.unwrapper.count();
  if (last_packet_count_ == count) {
    ++counters_.duplicates;
    return;
  }
  if (last_packet_count_) counters_.scan_gaps += count - *last_packet_count_ - 1;
  last_packet_count_ = count;
  packets_.emplace_back(CountedPacket{count, std::move(*pair)});
}

void PacketStream::handle(const ImuAttitude& message, double sent_before) {
  if (!accept(fault_in(message, config_), samples_rejected_)) return;
  const bool first = !samples_.unwrapper.last_id();
  const std::int64_t step = advance(samples_, scans_, message.packet_id, sent_before);
  if (step == 0 && !first) {
    ++counters_.duplicates;
    return;
  }
  if (!first) counters_.imu_gaps += step - 1;
  note_values(message);
  packets_.emplace_back(CountedImu{samples_.unwrapper.count(), sent_before, message});
}

bool PacketStream::accept(std::string_view fault, Rejections& rejections) {
  if (fault.empty()) {
    rejections = {};
    return true;
  }
  ++counters_.rejected_values;
  rejections = {rejections.in_a_row + 1, fault};
  return false;
}

void PacketStream::note_values(const ImuAttitude& message) {
  equal_gyro_samples_ = last_imu_ && last_imu_->gyro == message.gyro ? equal_gyro_samples_ + 1 : 0;
  equal_accel_samples_ = last_imu_ && last_imu_->accel == message.accel ? equal_accel_samples_ + 1 : 0;
  last_imu_ = message;
}

void PacketStream::note_sensor_time(const Auxiliary& message, std::int64_t packets_since) {
  housekeeping_.sensor_time_s = message.time_s + 1e-6 * message.time_us;
  const double expected_s = static_cast<double>(packets_since) * kScanPeriodUs * 1e-6;
  const std::optional<double> before = std::exchange(last_sensor_time_s_, housekeeping_.sensor_time_s);
  if (before && std::abs(housekeeping_.sensor_time_s - *before - expected_s) > kSensorTimeLeapS) restart();
}

void PacketStream::restart() {
  ++counters_.restarts;
  packets_.emplace_back(CountersRestarted{});
}

std::int64_t PacketStream::advance(Counter& counter, const Counter& other, std::uint16_t id, double sent_before) {
  const bool by_arrival = config_.time_source == "arrival";
  const double elapsed = by_arrival
                             ? sent_before - counter.last_sent
                             : static_cast<double>(other.unwrapper.count() - counter.count_of_other) * other.period_us;
  const std::int64_t step = counter.unwrapper.advance(id, elapsed, by_arrival ? kArrivalSlackUs : kCounterSlackUs);
  counter.last_sent = sent_before;
  counter.count_of_other = other.unwrapper.count();
  if (counter.unwrapper.guessed() && static_cast<double>(step) * counter.period_us > kPhaseLostUs) restart();
  return step;
}

}  // namespace ignis::l1
