// SPDX-License-Identifier: Apache-2.0
//
// The front end's state folder under a coverage-guided fuzzer: a checkpoint is gone on from or leads to a new session
// that says why, whatever its state holds, and a keyframe is whole or none. The checksums before them are those of
// fuzz_journal: here they fit.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/byte_record.h"
#include "frontend/checkpoint.h"
#include "require.h"

namespace {

using namespace ignis;
using fuzz::require;

constexpr char kHash[] = "0123456789abcdef";
constexpr std::int32_t kSession = 3;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto payload = std::as_bytes(std::span(data, size));
  const std::vector<std::byte> record = encode_record(payload);
  if (const std::optional<Keyframe> keyframe = decode_keyframe(record)) {
    require(std::ranges::equal(encode_keyframe(*keyframe), record));
  }
  std::vector<std::byte> checkpoint = encode_ended_session(kSession, kHash);
  checkpoint.insert(checkpoint.end(), record.begin(), record.end());
  Lio lio = start_from_checkpoint(FrontendConfig{}, kHash, checkpoint);
  require(!lio.start_note().empty());
  static_cast<void>(start_from_checkpoint(FrontendConfig{}, kHash, payload));
  return 0;
}
