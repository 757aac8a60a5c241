// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "drivers/mavlink_frame.h"
#include "require.h"

/// How the fuzz targets of the L1 read their inputs: as the raw stream, or as a list of payloads that get valid headers
/// and checksums, since nothing behind the checksum is ever reached by chance.
namespace ignis::fuzz {

/// Takes the input apart.
class Input {
 public:
  explicit Input(std::span<const std::byte> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  std::uint8_t byte() {
    const auto taken = take(1);
    return taken.empty() ? std::uint8_t{0} : std::to_integer<std::uint8_t>(taken.front());
  }
  std::span<const std::byte> take(std::size_t count) {
    const auto taken = bytes_.first(std::min(count, bytes_.size()));
    bytes_ = bytes_.subspan(taken.size());
    return taken;
  }

 private:
  std::span<const std::byte> bytes_;
};

inline constexpr std::uint32_t kIds[] = {l1::kAuxiliaryId, l1::kDistanceId,  l1::kImuId,      l1::kTimeSyncId,
                                         l1::kVersionId,   l1::kAuxiliaryId, l1::kDistanceId, 122};

/// A frame with a valid checksum around bytes of the input. Half of the packets are made plausible, so that pairs form.
inline std::vector<std::byte> framed(Input& input) {
  const std::uint8_t choice = input.byte();
  const std::uint32_t id = kIds[choice % std::size(kIds)];
  const std::size_t full = l1::message_info(id)->length;
  const auto body = input.take(1 + input.byte() % full);
  l1::Payload payload(body.begin(), body.end());
  if (choice & 0x80U) {
    const std::uint8_t packet = input.byte();
    if (id == l1::kAuxiliaryId) {
      l1::Auxiliary auxiliary = l1::decode_auxiliary(payload);
      auxiliary.packet_id = packet;
      auxiliary.payload_size = 120;
      payload = l1::encode(auxiliary);
    } else if (id == l1::kDistanceId) {
      l1::Distance distance = l1::decode_distance(payload);
      distance.packet_id = packet;
      distance.payload_size = 240;
      payload = l1::encode(distance);
    }
  }
  return l1::encode_frame(id, payload, choice);
}

/// The bytes of the next read: a stretch of the raw stream, or one whole frame.
inline std::vector<std::byte> next_read(Input& input, bool as_frame) {
  if (as_frame) return framed(input);
  const auto raw = input.take(1 + input.byte());
  return {raw.begin(), raw.end()};
}

}  // namespace ignis::fuzz
