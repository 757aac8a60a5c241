// SPDX-License-Identifier: Apache-2.0
#include "drivers/l1_messages.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <utility>

namespace ignis::l1 {

namespace {

static_assert(std::endian::native == std::endian::little, "the wire is little endian and copied as it lies");

constexpr MessageInfo kMessages[] = {
    {11, 1, 106},   {12, 1, 204},  {13, 38, 62},  {14, 1, 84},    {15, 56, 236},
    {16, 246, 74},  {17, 209, 99}, {18, 5, 12},   {19, 42, 110},  {121, 1, 228},
    {122, 20, 151}, {123, 61, 10}, {124, 44, 68}, {125, 36, 149}, {126, 1, 25},
};

/// Appends values in wire order.
class Writer {
 public:
  template <class Value>
  void operator()(const Value& value) {
    const auto* bytes = reinterpret_cast<const std::byte*>(&value);
    payload_.insert(payload_.end(), bytes, bytes + sizeof(Value));
  }
  void text(const std::string& value, std::size_t size) {
    const std::size_t used = std::min(value.size(), size);
    for (std::size_t i = 0; i < size; ++i)
      payload_.push_back(i < used ? static_cast<std::byte>(value[i]) : std::byte{0});
  }
  [[nodiscard]] Payload take() { return std::move(payload_); }

 private:
  Payload payload_;
};

/// Reads values in wire order; what a trimmed payload no longer carries is zero.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> payload) : payload_(payload) {}

  template <class Value>
  void operator()(Value& value) {
    std::array<std::byte, sizeof(Value)> bytes{};
    const std::size_t left = payload_.size() - std::min(payload_.size(), offset_);
    std::copy_n(payload_.data() + (payload_.size() - left), std::min(left, sizeof(Value)), bytes.data());
    std::memcpy(&value, bytes.data(), sizeof(Value));
    offset_ += sizeof(Value);
  }
  void text(std::string& value, std::size_t size) {
    value.clear();
    bool ended = false;
    for (std::size_t i = 0; i < size; ++i) {
      char character = 0;
      (*this)(character);
      ended = ended || character == 0;
      // Log readers and JSON expect text, whatever the wire says.
      if (!ended) value.push_back(character >= 0x20 && character < 0x7F ? character : '?');
    }
  }

 private:
  std::span<const std::byte> payload_;
  std::size_t offset_ = 0;
};

// One list of fields per message serves both directions.
void visit(auto& io, auto& message)
  requires requires { message.ranges_mm; }
{
  io(message.packet_id), io(message.packet_cnt), io(message.payload_size), io(message.ranges_mm);
}

void visit(auto& io, auto& message)
  requires requires { message.reflectivity; }
{
  io(message.sync_delay_us), io(message.time_s), io(message.time_us);
  io(message.sys_rotation_period_us), io(message.com_rotation_period_us);
  io(message.yaw_start_deg), io(message.yaw_step_deg), io(message.vertical_start_deg), io(message.vertical_step_deg);
  io(message.apd_temperature), io(message.dirty_index), io(message.imu_temperature);
  io(message.up_optical_q), io(message.down_optical_q), io(message.apd_voltage), io(message.imu_angle_offset);
  io(message.b_axis_mm), io(message.theta_rad), io(message.ksi_rad);
  io(message.packet_id), io(message.payload_size), io(message.work_status), io(message.reflectivity);
}

void visit(auto& io, auto& message)
  requires requires { message.quaternion; }
{
  io(message.quaternion), io(message.gyro), io(message.accel), io(message.packet_id);
}

void visit(auto& io, auto& message)
  requires requires { message.sys_soft; }
{
  io.text(message.sys_soft, 13), io.text(message.com_soft, 13), io.text(message.sys_hard, 6),
      io.text(message.com_hard, 6);
}

void visit(auto& io, auto& message)
  requires requires { message.count; }
{
  io(message.count), io(message.type);
}

void visit(auto& io, auto& message)
  requires requires { message.table; }
{
  io(message.rotation_period), io(message.zero_offset_ms), io(message.packet_id), io(message.mode), io(message.table);
}

template <class Message>
Payload encoded(const Message& message) {
  Writer writer;
  visit(writer, message);
  return writer.take();
}

template <class Message>
Message decoded(std::span<const std::byte> payload) {
  Message message;
  Reader reader(payload);
  visit(reader, message);
  return message;
}

}  // namespace

std::optional<MessageInfo> message_info(std::uint32_t id) {
  const auto* found = std::ranges::find(kMessages, id, &MessageInfo::id);
  if (found == std::end(kMessages)) return std::nullopt;
  return *found;
}

Payload encode(const Distance& message) { return encoded(message); }
Payload encode(const Auxiliary& message) { return encoded(message); }
Payload encode(const ImuAttitude& message) { return encoded(message); }
Payload encode(const Version& message) { return encoded(message); }
Payload encode(const TimeSync& message) { return encoded(message); }
Payload encode(const LedRing& message) { return encoded(message); }
Payload encode(DataRequest request) { return {static_cast<std::byte>(std::to_underlying(request))}; }
Payload encode(WorkingMode mode) { return {static_cast<std::byte>(std::to_underlying(mode))}; }

Distance decode_distance(std::span<const std::byte> payload) { return decoded<Distance>(payload); }
Auxiliary decode_auxiliary(std::span<const std::byte> payload) { return decoded<Auxiliary>(payload); }
ImuAttitude decode_imu(std::span<const std::byte> payload) { return decoded<ImuAttitude>(payload); }
Version decode_version(std::span<const std::byte> payload) { return decoded<Version>(payload); }
TimeSync decode_time_sync(std::span<const std::byte> payload) { return decoded<TimeSync>(payload); }
LedRing decode_led_ring(std::span<const std::byte> payload) { return decoded<LedRing>(payload); }
std::uint8_t decode_byte(std::span<const std::byte> payload) {
  return payload.empty() ? std::uint8_t{0} : std::to_integer<std::uint8_t>(payload.front());
}

std::string work_status_text(std::uint8_t status) {
  constexpr const char* kBits[] = {"raw mode",  "LED data loss",     "point loss",        "built-in LED pattern",
                                   "IMU error", "SYS encoder error", "COM encoder error", "data not available"};
  std::string text;
  for (std::size_t bit = 0; bit < 8; ++bit) {
    if ((status >> bit & 1U) == 0) continue;
    if (!text.empty()) text += ", ";
    text += kBits[bit];
  }
  return text;
}

}  // namespace ignis::l1
