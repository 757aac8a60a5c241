// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// Bytes that tell whether they are whole: a record is its length (uint32), the CRC-32 of its payload (uint32) and the
/// payload. Little-endian.
namespace ignis {

inline constexpr std::size_t kRecordFrameBytes = 2 * sizeof(std::uint32_t);

/// The payload of a record, or why there is none.
struct RecordAt {
  std::span<const std::byte> payload;
  std::string damage;
  bool reaches_end = false;  ///< the damage may be a write that was cut short
};

/// One record. Throws std::length_error when the payload exceeds 256 MB.
[[nodiscard]] std::vector<std::byte> encode_record(std::span<const std::byte> payload);

/// The record that begins at `offset`, at most the end of any bytes at all.
[[nodiscard]] RecordAt record_at(std::span<const std::byte> bytes, std::size_t offset);

}  // namespace ignis
