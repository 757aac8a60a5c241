// SPDX-License-Identifier: Apache-2.0
#include "sensor_session.h"

#include <format>

#include "runtime/application.h"
#include "runtime/steady_time.h"

namespace ignis {
namespace {

constexpr int kReadTimeoutMs = 20;

std::unique_ptr<l1::ByteLink> opened(const DriverConfig& config) {
  try {
    return l1::open_link(config.port, config.baud);
  } catch (const l1::LinkError& error) {
    throw runtime::UserError(error.what(), runtime::kFailed);
  }
}

}  // namespace

SensorSession::SensorSession(const DriverConfig& config) : config_(config), link_(opened(config)), stream_(config) {}

std::vector<l1::Packet> SensorSession::read() {
  try {
    const std::size_t count = link_->read(buffer_, kReadTimeoutMs);
    auto packets = stream_.feed(std::span<const std::byte>(buffer_).first(count), runtime::steady_now());
    for (const l1::Packet& packet : packets) {
      const auto* sync = std::get_if<l1::TimeSync>(&packet);
      if (sync != nullptr && sync->type == l1::TimeSync::kRequest) write(frames_.time_sync_answer(sync->count));
    }
    return packets;
  } catch (const l1::LinkError& error) {
    throw runtime::UserError(error.what(), runtime::kFailed);
  }
}

void SensorSession::write(const std::vector<std::byte>& frame) {
  try {
    link_->write(frame);
  } catch (const l1::LinkError& error) {
    throw runtime::UserError(error.what(), runtime::kFailed);
  }
}

std::string SensorSession::what_came() const {
  const l1::StreamCounters counters = stream_.counters();
  if (counters.framing.bytes == 0) return std::format("not one byte came from {}; has the sensor power?", config_.port);
  if (counters.framing.frames == 0) {
    return std::format("{} bytes came from {}, but no valid frame: wrong speed ({} baud), or another device",
                       counters.framing.bytes, config_.port, config_.baud);
  }
  return std::format("{} frames came from {}", counters.framing.frames, config_.port);
}

}  // namespace ignis
