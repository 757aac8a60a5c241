// SPDX-License-Identifier: Apache-2.0
//
// The map's journal under a coverage-guided fuzzer: what a record's bytes say is written again as the same bytes, and a
// map takes whatever they hold. The checksums before it are those of fuzz_journal.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "map/map_record.h"
#include "require.h"

namespace {

using namespace ignis;
using fuzz::require;

constexpr std::size_t kMaxPoints = 64;  // more only cost time

std::vector<MapRecord> records_in(std::span<const std::byte> input) {
  std::vector<MapRecord> records;
  while (!input.empty()) {
    const std::size_t length = std::min<std::size_t>(input.size() - 1, 2U * std::to_integer<std::size_t>(input[0]));
    const std::span<const std::byte> payload = input.subspan(1, length);
    if (std::optional<MapRecord> record = decode_record(payload)) {
      require(std::ranges::equal(encode(*record), payload));
      if (record->points.size() <= kMaxPoints) records.push_back(std::move(*record));
    }
    input = input.subspan(1 + length);
  }
  return records;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  if (const std::optional<MapRecordHead> head = decode_head(bytes)) {
    require(std::ranges::equal(encode(*head), bytes));
  }
  std::vector<MapRecord> records = records_in(bytes);
  std::size_t points = 0;
  for (const MapRecord& record : records) points += record.points.size();
  LiveMap map{MapConfig{}};
  restore(map, std::move(records));
  require(map.clouds().points() <= points);
  return 0;
}
