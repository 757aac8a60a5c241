// SPDX-License-Identifier: Apache-2.0
#include "frontend/checkpoint.h"

#include <array>
#include <format>
#include <limits>

#include "common/byte_codec.h"
#include "common/byte_record.h"
#include "common/measurement_bytes.h"

namespace ignis {
namespace {

constexpr std::array<char, 8> kMagic{'I', 'G', 'N', 'I', 'S', 'F', 'E', 'C'};

constexpr std::size_t kBytesBesideMap = 1U << 18U;  // about
constexpr std::size_t kBytesPerMapPoint = 36;       // about: its block has a share in it

struct Head {
  std::array<char, 8> magic = kMagic;
  std::uint32_t version = kCheckpointVersion;
  std::string config_hash;
  std::int32_t session = 0;
};

void transfer(auto& io, FieldsOf<Head> auto& head) {
  for (auto& letter : head.magic) io.number(letter);
  io.number(head.version);
  io.text(head.config_hash);
  io.number(head.session);
}

std::vector<std::byte> record_of(const auto& value, std::size_t expected_bytes = 0) {
  return encode_record(to_bytes(value, expected_bytes));
}

/// Why the bytes are no `value`; empty when they are.
std::string read_whole(const RecordAt& record, auto& value) {
  if (!record.damage.empty()) return record.damage;
  ByteReader reader(record.payload);
  transfer(reader, value);
  return reader.failed() || !reader.at_end() ? "its contents are impossible" : "";
}

std::string refusal(const Head& head, bool is_alone, const FrontendConfig& config, const std::string& config_hash) {
  if (head.version != kCheckpointVersion) {
    return std::format("it has version {}, this build writes {}", head.version, kCheckpointVersion);
  }
  if (head.config_hash != config_hash) return "it was written under another configuration";
  if (config.resume_max_gap_s <= 0.0) return "frontend.resume_max_gap_s is 0";
  if (is_alone) return "its session has ended";
  return {};
}

}  // namespace

std::vector<std::byte> encode_ended_session(std::int32_t session, const std::string& config_hash) {
  Head head;
  head.config_hash = config_hash;
  head.session = session;
  return record_of(head);
}

std::vector<std::byte> encode_checkpoint(const Lio& lio, const std::string& config_hash) {
  std::vector<std::byte> bytes = encode_ended_session(lio.session(), config_hash);
  const std::vector<std::byte> body =
      record_of(lio, kBytesBesideMap + kBytesPerMapPoint * static_cast<std::size_t>(lio.map().size()));
  bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

Lio start_from_checkpoint(const FrontendConfig& config, const std::string& config_hash,
                          std::span<const std::byte> bytes) {
  if (bytes.empty()) return Lio(config);
  const RecordAt first = record_at(bytes, 0);
  Head head;
  std::string problem = read_whole(first, head);
  if (problem.empty() && head.magic != kMagic) problem = "it is no checkpoint";
  if (!problem.empty() || head.session < 0 || head.session == std::numeric_limits<std::int32_t>::max()) {
    return Lio(config, 0, std::format("new session: the checkpoint is not used ({})", problem));
  }
  problem = refusal(head, bytes.size() == kRecordFrameBytes + first.payload.size(), config, config_hash);
  if (problem.empty()) {
    Lio lio(config);
    problem = read_whole(record_at(bytes, kRecordFrameBytes + first.payload.size()), lio);
    if (problem.empty() && lio.is_sound() && lio.session() >= head.session) {
      lio.resume();
      return lio;
    }
    if (problem.empty()) problem = "its state is not sound";
  }
  return Lio(config, head.session + 1, std::format("new session: the checkpoint is not used ({})", problem));
}

std::vector<std::byte> encode_keyframe(const Keyframe& keyframe) { return record_of(keyframe); }

std::optional<Keyframe> decode_keyframe(std::span<const std::byte> bytes) {
  Keyframe keyframe;
  if (!read_whole(record_at(bytes, 0), keyframe).empty()) return std::nullopt;
  return keyframe;
}

}  // namespace ignis
