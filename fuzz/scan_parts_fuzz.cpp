// SPDX-License-Identifier: Apache-2.0
//
// L1_SCAN read straight from its bytes (EncodedScanAssembler) beside the way over the generated decoder
// (DecodedScanAssembler): whatever the parts, their order and the damage, both take the same and make the same scans.
// The input is a list of parts, built whole from its bytes, since no fuzzer guesses counts that fit a length, then
// perhaps damaged.

#include <fuzzer/FuzzedDataProvider.h>

#include <cstdint>
#include <cstring>
#include <list>
#include <optional>
#include <vector>

#include "decoded_scan_assembler.h"
#include "messages/length_check.h"
#include "messages/sensor_messages.h"
#include "require.h"

namespace {

using namespace ignis;
using fuzz::require;

constexpr int kMaxPoints = 12;
constexpr int kMaxParts = 64;

std::vector<float> floats(FuzzedDataProvider& input, int count) {
  std::vector<float> values(static_cast<std::size_t>(count));
  for (float& value : values) {
    const auto bits = input.ConsumeIntegral<std::uint32_t>();  // any float, also those that are no numbers
    std::memcpy(&value, &bits, sizeof value);
  }
  return values;
}

std::vector<std::byte> encoded_part(FuzzedDataProvider& input) {
  scan_t part;
  part.utime = input.ConsumeIntegralInRange<std::int64_t>(0, 1000);
  part.sequence = input.ConsumeIntegralInRange<std::int32_t>(0, 3);
  part.part_count = input.ConsumeIntegralInRange<std::int16_t>(-1, 4);
  part.part = input.ConsumeIntegralInRange<std::int16_t>(-1, 4);
  part.duration_us = input.ConsumeIntegral<std::int32_t>();
  part.missing_packets = input.ConsumeIntegral<std::int32_t>();
  part.num_points = input.ConsumeIntegralInRange<std::int32_t>(0, kMaxPoints);
  part.x = floats(input, part.num_points);
  part.y = floats(input, part.num_points);
  part.z = floats(input, part.num_points);
  part.intensity = floats(input, part.num_points);
  for (int i = 0; i < part.num_points; ++i) part.dt_us.push_back(input.ConsumeIntegral<std::int32_t>());
  std::vector<std::byte> data(static_cast<std::size_t>(part.getEncodedSize()));
  part.encode(data.data(), 0, static_cast<int>(data.size()));
  return data;
}

void damage(std::vector<std::byte>& data, FuzzedDataProvider& input) {
  const auto at = input.ConsumeIntegralInRange<std::size_t>(0, data.size() - 1);
  if (input.ConsumeBool()) {
    data[at] ^= static_cast<std::byte>(input.ConsumeIntegralInRange<int>(1, 255));
  } else {
    data.resize(at);
  }
}

bool same_bits(float a, float b) { return std::memcmp(&a, &b, sizeof a) == 0; }

void require_equal(const Scan& a, const Scan& b) {
  require(a.utime == b.utime && a.sequence == b.sequence && a.duration_us == b.duration_us);
  require(a.missing_packets == b.missing_packets && a.points.size() == b.points.size());
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) require(same_bits(a.points[i].position[axis], b.points[i].position[axis]));
    require(same_bits(a.points[i].intensity, b.points[i].intensity) && a.points[i].dt_us == b.points[i].dt_us);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  FuzzedDataProvider input(bytes, size);
  messages::EncodedScanAssembler encoded;
  messages::DecodedScanAssembler decoded;
  std::list<std::vector<std::byte>> parts;  // they have to outlive what waits for them
  for (int i = 0; i < kMaxParts && input.remaining_bytes() > 0; ++i) {
    std::vector<std::byte>& part = parts.emplace_back(encoded_part(input));
    if (input.ConsumeIntegralInRange<int>(0, 7) == 0) damage(part, input);
    scan_t message;
    const bool taken = messages::decode_checked(part, message);
    require(taken == messages::read_scan_head(part).has_value());
    const std::optional<messages::EncodedScan> from_bytes = encoded.add(part);
    const std::optional<Scan> from_message = taken ? decoded.add(message) : std::nullopt;
    require(from_bytes.has_value() == from_message.has_value());
    if (from_bytes) require_equal(from_bytes->read(), *from_message);
  }
  return 0;
}
