// SPDX-License-Identifier: Apache-2.0
#include "drivers/mavlink_frame.h"

#include <cassert>

namespace ignis::l1 {

namespace {

std::size_t trimmed_size(std::span<const std::byte> payload) {
  std::size_t size = payload.size();
  while (size > 1 && payload[size - 1] == std::byte{0}) --size;
  return size;
}

}  // namespace

std::uint16_t crc16(std::span<const std::byte> bytes, std::uint16_t crc) {
  for (const std::byte byte : bytes) {
    auto mixed = static_cast<std::uint8_t>(std::to_integer<unsigned>(byte) ^ (crc & 0xFFU));
    mixed = static_cast<std::uint8_t>(mixed ^ (mixed << 4U));
    crc = static_cast<std::uint16_t>((crc >> 8U) ^ (mixed << 8U) ^ (mixed << 3U) ^ (mixed >> 4U));
  }
  return crc;
}

std::vector<std::byte> encode_frame(std::uint32_t id, std::span<const std::byte> payload, std::uint8_t sequence,
                                    Trim trim, FrameAddress address) {
  const auto info = message_info(id);
  assert(info && !payload.empty() && payload.size() <= info->length);
  if (trim == Trim::kYes) payload = payload.first(trimmed_size(payload));

  std::vector<std::byte> frame = {kMagic,
                                  static_cast<std::byte>(payload.size()),
                                  std::byte{0},
                                  std::byte{0},
                                  std::byte{sequence},
                                  std::byte{address.system},
                                  std::byte{address.component},
                                  static_cast<std::byte>(id),
                                  static_cast<std::byte>(id >> 8U),
                                  static_cast<std::byte>(id >> 16U)};
  frame.insert(frame.end(), payload.begin(), payload.end());
  const std::byte extra[] = {std::byte{info->crc_extra}};
  const std::uint16_t crc = crc16(extra, crc16(std::span(frame).subspan(1)));
  frame.push_back(static_cast<std::byte>(crc));
  frame.push_back(static_cast<std::byte>(crc >> 8U));
  return frame;
}

}  // namespace ignis::l1
