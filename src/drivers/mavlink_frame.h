// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/l1_messages.h"

/// MAVLink 2 frames: 10 byte header, payload, 2 byte checksum, 13 byte signature when bit 0 of the incompat flags is
/// set. Source: the MAVLink serialization guide (packet format, checksum, payload truncation).
namespace ignis::l1 {

inline constexpr std::byte kMagic{0xFD};
inline constexpr std::size_t kHeaderSize = 10;
inline constexpr std::size_t kChecksumSize = 2;
inline constexpr std::size_t kSignatureSize = 13;

/// CRC-16/MCRF4XX of `bytes`, continued from `crc`. Of the text "123456789" it is 0x6F91.
[[nodiscard]] std::uint16_t crc16(std::span<const std::byte> bytes, std::uint16_t crc = 0xFFFF);

/// Whether a sender removes the trailing zeros of the payload (at least one byte stays). Receivers accept both.
enum class Trim { kNo, kYes };

struct FrameAddress {
  std::uint8_t system = 1;
  std::uint8_t component = 1;
};

/// The frame's bytes. `id` must be in the dialect and `payload` no longer than its full length: asserted.
[[nodiscard]] std::vector<std::byte> encode_frame(std::uint32_t id, std::span<const std::byte> payload,
                                                  std::uint8_t sequence, Trim trim = Trim::kYes,
                                                  FrameAddress address = {});

}  // namespace ignis::l1
