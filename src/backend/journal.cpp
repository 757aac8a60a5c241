// SPDX-License-Identifier: Apache-2.0
#include "backend/journal.h"

#include <array>
#include <boost/crc.hpp>
#include <format>
#include <stdexcept>

#include "backend/byte_codec.h"

namespace ignis {
namespace {

constexpr std::array<char, 8> kMagic{'I', 'G', 'N', 'I', 'S', 'J', 'N', 'L'};
constexpr std::size_t kFrameBytes = 2 * sizeof(std::uint32_t);
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

/// The payload of the record that begins at `offset`, or why there is none.
struct RecordAt {
  std::span<const std::byte> payload;
  std::string damage;
  bool reaches_end = false;  ///< the damage may be a write that was cut short
};

RecordAt record_at(std::span<const std::byte> bytes, std::size_t offset) {
  const std::span<const std::byte> rest = bytes.subspan(offset);
  if (rest.size() < kFrameBytes) return {{}, std::format("{} of {} bytes of a frame", rest.size(), kFrameBytes), true};
  Frame frame;
  ByteReader reader(rest);
  reader.number(frame.size);
  reader.number(frame.crc);
  const std::span<const std::byte> body = rest.subspan(kFrameBytes);
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

}  // namespace

std::vector<std::byte> encode_record(std::span<const std::byte> payload) {
  if (payload.size() > kMaxPayload) throw std::length_error("a journal record exceeds 256 MB");
  std::vector<std::byte> bytes;
  bytes.reserve(kFrameBytes + payload.size());
  ByteWriter writer(bytes);
  writer.number(static_cast<std::uint32_t>(payload.size()));
  writer.number(checksum(payload));
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  return bytes;
}

std::vector<std::byte> encode_head(const JournalHead& head) {
  std::vector<std::byte> payload;
  ByteWriter writer(payload);
  for (const char letter : kMagic) writer.number(letter);
  writer.number(head.version);
  writer.text(head.config_fingerprint);
  writer.number(head.session);
  return encode_record(payload);
}

JournalContents read_journal(std::span<const std::byte> bytes) {
  JournalContents contents;
  const RecordAt first = record_at(bytes, 0);
  std::array<char, 8> magic{};
  ByteReader reader(first.payload);
  for (char& letter : magic) reader.number(letter);
  reader.number(contents.head.version);
  reader.text(contents.head.config_fingerprint);
  reader.number(contents.head.session);
  contents.is_journal = magic == kMagic && !reader.failed();
  if (!contents.is_journal) {
    contents.damage = first.damage.empty() ? "the head is not a journal's" : "no head: " + first.damage;
    contents.torn_tail = bytes.empty() || first.reaches_end;
    return contents;
  }
  contents.whole_bytes = kFrameBytes + first.payload.size();
  while (contents.whole_bytes < bytes.size()) {
    const RecordAt record = record_at(bytes, contents.whole_bytes);
    if (!record.damage.empty()) {
      contents.damage = std::format("{} at byte {} of {}", record.damage, contents.whole_bytes, bytes.size());
      contents.torn_tail = record.reaches_end;
      break;
    }
    contents.payloads.push_back(record.payload);
    contents.whole_bytes += kFrameBytes + record.payload.size();
  }
  return contents;
}

}  // namespace ignis
