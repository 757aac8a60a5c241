// SPDX-License-Identifier: Apache-2.0
#include "backend/journal/journal.h"

#include <array>
#include <format>

#include "common/byte_codec.h"

namespace ignis {
namespace {

constexpr std::array<char, 8> kMagic{'I', 'G', 'N', 'I', 'S', 'J', 'N', 'L'};

}  // namespace

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
  contents.whole_bytes = kRecordFrameBytes + first.payload.size();
  while (contents.whole_bytes < bytes.size()) {
    const RecordAt record = record_at(bytes, contents.whole_bytes);
    if (!record.damage.empty()) {
      contents.damage = std::format("{} at byte {} of {}", record.damage, contents.whole_bytes, bytes.size());
      contents.torn_tail = record.reaches_end;
      break;
    }
    contents.payloads.push_back(record.payload);
    contents.whole_bytes += kRecordFrameBytes + record.payload.size();
  }
  return contents;
}

}  // namespace ignis
