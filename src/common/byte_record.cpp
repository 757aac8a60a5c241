// SPDX-License-Identifier: Apache-2.0
#include "common/byte_record.h"

#include <boost/crc.hpp>
#include <format>
#include <stdexcept>

#include "common/byte_codec.h"

namespace ignis {
namespace {

constexpr std::size_t kMaxPayload = 256U << 20U;  // an announced length beyond it is damage

std::uint32_t checksum(std::span<const std::byte> bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

struct Frame {
  std::uint32_t size = 0;
  std::uint32_t crc = 0;
};

}  // namespace

std::vector<std::byte> encode_record(std::span<const std::byte> payload) {
  if (payload.size() > kMaxPayload) throw std::length_error("a record exceeds 256 MB");
  std::vector<std::byte> bytes;
  bytes.reserve(kRecordFrameBytes + payload.size());
  ByteWriter writer(bytes);
  writer.number(static_cast<std::uint32_t>(payload.size()));
  writer.number(checksum(payload));
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

RecordAt record_at(std::span<const std::byte> bytes, std::size_t offset) {
  const std::span<const std::byte> rest = bytes.subspan(offset);
  if (rest.size() < kRecordFrameBytes)
    return {{}, std::format("{} of {} bytes of a frame", rest.size(), kRecordFrameBytes), true};
  Frame frame;
  ByteReader reader(rest);
  reader.number(frame.size);
  reader.number(frame.crc);
  const std::span<const std::byte> body = rest.subspan(kRecordFrameBytes);
  if (frame.size > kMaxPayload) return {{}, std::format("an impossible length of {}", frame.size), false};
  if (frame.size > body.size()) {
    return {{}, std::format("{} of the {} bytes of a record", body.size(), frame.size), true};
  }
  const std::span<const std::byte> payload = body.first(frame.size);
  // Files grow before their blocks are written: a power cut leaves zeros, or the beginning of a record, at the end.
  if (checksum(payload) != frame.crc) return {{}, "a record whose checksum is wrong", frame.size == body.size()};
  if (frame.size == 0) return {{}, "an empty record", false};
  return {payload, {}, false};
}

}  // namespace ignis
