// SPDX-License-Identifier: Apache-2.0
#include "drivers/l1_decoder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/config_check.h"
#include "drivers/value_checks.h"

namespace ignis::l1 {

namespace {

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
      stream_(config),
      clock_(config),
      assembler_(config.packets_per_scan) {}

std::vector<Event> L1Decoder::feed(std::span<const std::byte> bytes, Utime arrival) {
  return handle(stream_.feed(bytes, arrival));
}

std::vector<Event> L1Decoder::finish() {
  std::vector<Event> events = handle(stream_.finish());
  publish_waiting(events);
  if (auto scan = assembler_.end()) publish(std::move(*scan), events);
  return events;
}

std::vector<Event> L1Decoder::handle(const std::vector<Packet>& packets) {
  std::vector<Event> events;
  for (const Packet& packet : packets) {
    std::visit([this](const auto& each) { handle(each); }, packet);
    if (clock_.ready() || waiting_.size() > kMostWaiting) publish_waiting(events);
  }
  return events;
}

std::vector<std::byte> L1Decoder::take_outgoing() { return std::exchange(outgoing_, {}); }

DecoderCounters L1Decoder::counters() const {
  DecoderCounters counters = counters_;
  static_cast<StreamCounters&>(counters) = stream_.counters();
  counters.clock_restarts = counters.restarts + clock_.restarts();
  return counters;
}

void L1Decoder::handle(const AuxiliarySeen& seen) {
  if (seen.is_new) clock_.on_auxiliary(seen.count, seen.sent_before);
}

void L1Decoder::handle(const CountedPacket& packet) {
  clock_.on_distance(packet.count);
  std::vector<BodyPoint> points = mount_.to_body(points_of(packet.pair, config_));
  counters_.points_filtered += returns_of(packet.pair.distance) - std::ssize(points);
  waiting_.push_back(PacketRecord{packet.count, std::move(points)});
}

void L1Decoder::handle(const CountedImu& imu) {
  clock_.on_imu(imu.count, imu.sent_before);
  ImuSample sample = mount_.to_body(to_vector(imu.attitude.gyro), to_vector(imu.attitude.accel));
  sample.saturated = is_saturated(imu.attitude, config_);
  waiting_.push_back(ImuRecord{imu.count, sample});
}

void L1Decoder::handle(const TimeSync& message) {
  if (message.type != TimeSync::kRequest) return;
  const auto frame = host_frames_.time_sync_answer(message.count);
  outgoing_.insert(outgoing_.end(), frame.begin(), frame.end());
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
