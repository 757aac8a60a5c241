// SPDX-License-Identifier: Apache-2.0
#include "drivers/l1_decoder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/config_check.h"
#include "drivers/value_checks.h"

namespace ignis::l1 {

namespace {

/// Late arrivals stretch what a counter may have moved; without arrivals only the counters themselves tell.
constexpr double kArrivalSlackUs = 1e6;
constexpr double kCounterSlackUs = 60e6;
/// A capture without one of the streams never aligns them; it must not wait for ever.
constexpr std::size_t kMostWaiting = 600;

const DriverConfig& checked(const DriverConfig& config) {
  config::require_valid(config, "driver");
  return config;
}

const Extrinsics& checked(const Extrinsics& extrinsics) {
  config::require_valid(extrinsics, "extrinsics");
  return extrinsics;
}

Eigen::Vector3d to_vector(const std::array<float, 3>& values) {
  return Eigen::Vector3f(values[0], values[1], values[2]).cast<double>();
}

}  // namespace

L1Decoder::L1Decoder(const DriverConfig& config, const Extrinsics& extrinsics)
    : config_(checked(config)),
      mount_(checked(extrinsics), config.own_structure),
      clock_(config),
      scan_counter_(kScanPeriodUs),
      imu_counter_(kImuPeriodUs),
      assembler_(config.packets_per_scan) {}

std::vector<Event> L1Decoder::feed(std::span<const std::byte> bytes, Utime arrival) {
  parser_.feed(bytes, arrival);
  std::vector<Event> events;
  while (const auto frame = parser_.next()) {
    handle(*frame);
    if (clock_.ready() || waiting_.size() > kMostWaiting) publish_waiting(events);
  }
  return events;
}

std::vector<Event> L1Decoder::finish() {
  std::vector<Event> events;
  parser_.finish();
  while (const auto frame = parser_.next()) handle(*frame);
  publish_waiting(events);
  if (auto scan = assembler_.end()) publish(std::move(*scan), events);
  return events;
}

std::vector<std::byte> L1Decoder::take_outgoing() { return std::exchange(outgoing_, {}); }

std::vector<std::byte> L1Decoder::version_request() {
  return encode_frame(kRequestDataId, encode(DataRequest::kVersion), outgoing_sequence_++);
}

DecoderCounters L1Decoder::counters() const {
  DecoderCounters counters = counters_;
  counters.framing = parser_.counters();
  counters.pairing = pairer_.counters();
  counters.duplicates += counters.pairing.duplicates;
  return counters;
}

void L1Decoder::handle(const Frame& frame) {
  pairer_.on_frame();
  switch (frame.id) {
    case kAuxiliaryId:
      return handle(decode_auxiliary(frame.payload), frame.sent_before);
    case kDistanceId:
      return handle(decode_distance(frame.payload), frame.sent_before);
    case kImuId:
      return handle(decode_imu(frame.payload), frame.sent_before);
    case kTimeSyncId:
      return handle(decode_time_sync(frame.payload));
    case kVersionId:
      housekeeping_.firmware = decode_version(frame.payload).sys_soft;
      return;
    default:
      ++counters_.unknown_messages;
  }
}

void L1Decoder::handle(const Auxiliary& message, double sent_before) {
  if (!accept(fault_in(message, config_))) return;
  housekeeping_.apd_temperature = message.apd_temperature;
  housekeeping_.imu_temperature = message.imu_temperature;
  housekeeping_.dirty_index = message.dirty_index;
  housekeeping_.work_status = message.work_status;

  const double slack = config_.time_source == "arrival" ? kArrivalSlackUs : kCounterSlackUs;
  const std::int64_t step = scan_counter_.advance(message.packet_id, elapsed_for_scan(sent_before), slack);
  last_scan_sent_ = sent_before;
  imu_count_at_scan_ = imu_counter_.count();
  if (step > 0 || !last_packet_count_) clock_.on_auxiliary(scan_counter_.count(), sent_before);
  pairer_.on_auxiliary(message, sent_before);
}

void L1Decoder::handle(const Distance& message, double sent_before) {
  if (!accept(fault_in(message, config_))) return;
  const auto packet = pairer_.on_distance(message, sent_before);
  if (!packet) return;
  const std::int64_t count = scan_counter_.count();
  if (last_packet_count_ == count) {
    ++counters_.duplicates;
    return;
  }
  if (last_packet_count_) counters_.scan_gaps += count - *last_packet_count_ - 1;
  last_packet_count_ = count;
  clock_.on_distance(count);
  std::vector<BodyPoint> points = mount_.to_body(points_of(*packet, config_));
  counters_.points_filtered += returns_of(message) - std::ssize(points);
  waiting_.push_back(PacketRecord{count, std::move(points)});
}

void L1Decoder::handle(const ImuAttitude& message, double sent_before) {
  if (!accept(fault_in(message, config_))) return;
  const bool first = !imu_counter_.last_id();
  const double slack = config_.time_source == "arrival" ? kArrivalSlackUs : kCounterSlackUs;
  const std::int64_t step = imu_counter_.advance(message.packet_id, elapsed_for_imu(sent_before), slack);
  last_imu_sent_ = sent_before;
  scan_count_at_imu_ = scan_counter_.count();
  if (step == 0 && !first) {
    ++counters_.duplicates;
    return;
  }
  if (!first) counters_.imu_gaps += step - 1;
  note_values(message);
  clock_.on_imu(imu_counter_.count(), sent_before);
  ImuSample sample = mount_.to_body(to_vector(message.gyro), to_vector(message.accel));
  sample.saturated = is_saturated(message, config_);
  waiting_.push_back(ImuRecord{imu_counter_.count(), sample});
}

void L1Decoder::handle(const TimeSync& message) {
  if (message.type != TimeSync::kRequest) return;
  const Payload answer = encode(TimeSync{message.count, TimeSync::kResponse});
  const auto frame = encode_frame(kTimeSyncId, answer, outgoing_sequence_++);
  outgoing_.insert(outgoing_.end(), frame.begin(), frame.end());
}

bool L1Decoder::accept(std::string_view fault) {
  if (fault.empty()) {
    health_.rejected_in_a_row = 0;
    return true;
  }
  ++counters_.rejected_values;
  ++health_.rejected_in_a_row;
  health_.rejected_field = fault;
  return false;
}

void L1Decoder::note_values(const ImuAttitude& message) {
  const bool equal = last_imu_ && last_imu_->gyro == message.gyro && last_imu_->accel == message.accel;
  health_.equal_imu_samples = equal ? health_.equal_imu_samples + 1 : 0;
  last_imu_ = message;
}

double L1Decoder::elapsed_for_scan(double sent_before) const {
  if (config_.time_source == "arrival") return sent_before - last_scan_sent_;
  return static_cast<double>(imu_counter_.count() - imu_count_at_scan_) * kImuPeriodUs;
}

double L1Decoder::elapsed_for_imu(double sent_before) const {
  if (config_.time_source == "arrival") return sent_before - last_imu_sent_;
  return static_cast<double>(scan_counter_.count() - scan_count_at_imu_) * kScanPeriodUs;
}

void L1Decoder::publish_waiting(std::vector<Event>& events) {
  for (const Record& record : std::exchange(waiting_, {})) {
    std::visit([&](const auto& each) { publish(each, events); }, record);
  }
}

void L1Decoder::publish(const ImuRecord& record, std::vector<Event>& events) {
  ImuSample sample = record.sample;
  const double time_us = clock_.imu_time(record.count);
  if (auto overdue = assembler_.end_if_overdue(time_us)) publish(std::move(*overdue), events);
  sample.utime = std::llround(time_us);
  sample.sequence = imu_sequence_++;
  ++counters_.imu_published;
  newest_utime_ = std::max(newest_utime_, sample.utime);
  events.emplace_back(sample);
}

void L1Decoder::publish(const PacketRecord& record, std::vector<Event>& events) {
  const double time_us = clock_.packet_time(record.count);
  for (Scan& scan : assembler_.add(record.count, time_us, record.points)) publish(std::move(scan), events);
}

void L1Decoder::publish(Scan scan, std::vector<Event>& events) {
  ++counters_.scans_published;
  counters_.points_published += std::ssize(scan.points);
  newest_utime_ = std::max(newest_utime_, scan.end_utime());
  events.emplace_back(std::move(scan));
}

}  // namespace ignis::l1
