// SPDX-License-Identifier: Apache-2.0
//
// The back end's journal under a coverage-guided fuzzer: framing, checksums, records and the graph that they build.
// Half of the inputs are framed with valid checksums first, since nothing behind these is ever reached by chance.

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "backend/journal/graph_change.h"
#include "backend/journal/journal.h"

namespace {

using namespace ignis;

void require(bool holds) {
  if (!holds) std::abort();
}

/// The input as payloads of 1 to 256 bytes, each in a record of its own.
std::vector<std::byte> framed(std::span<const std::byte> input) {
  std::vector<std::byte> bytes = encode_head({kJournalVersion, "fuzz", 1});
  while (!input.empty()) {
    const std::size_t length = std::min<std::size_t>(input.size() - 1, 1 + 4U * std::to_integer<std::size_t>(input[0]));
    const std::vector<std::byte> record = encode_record(input.subspan(1, length));
    bytes.insert(bytes.end(), record.begin(), record.end());
    input = input.subspan(1 + length);
  }
  return bytes;
}

void check(std::span<const std::byte> bytes) {
  const JournalContents contents = read_journal(bytes);
  require(contents.whole_bytes <= bytes.size());
  if (!contents.is_journal) {
    require(contents.payloads.empty() && contents.whole_bytes == 0 && !contents.damage.empty());
    return;
  }
  require(contents.damage.empty() == (contents.whole_bytes == bytes.size()));
  RestoredGraph graph{BackendConfig()};
  for (const std::span<const std::byte> payload : contents.payloads) {
    require(payload.data() >= bytes.data() && payload.data() + payload.size() <= bytes.data() + contents.whole_bytes);
    std::optional<GraphChange> change = decode_change(payload);
    if (!change || !graph.apply(std::move(*change)).empty()) break;
    require(graph.state.nodes.size() == graph.state.clouds.size());
    require(graph.state.nodes.size() == graph.linearised.size());
    for (std::size_t i = 0; i < graph.linearised.size(); ++i) {
      require(graph.linearised[i].id == graph.state.nodes[i].end.id);
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  check(bytes);
  if (!bytes.empty()) check(framed(bytes));
  return 0;
}
