// SPDX-License-Identifier: Apache-2.0
#include "map_builder/process_table.h"

#include <utility>

namespace ignis {
namespace {

constexpr char kSilentState[] = "silent";
constexpr std::size_t kMaxProcesses = 32;  // the names come from the bus

const char* state_name(std::int8_t state) {
  switch (state) {
    case health_t::OK:
      return "ok";
    case health_t::DEGRADED:
      return "degraded";
    case health_t::LOST:
      return "lost";
    default:
      return "fault";
  }
}

}  // namespace

std::optional<ProcessTable::Change> ProcessTable::record(const health_t& message, TimePoint now) {
  if (entries_.size() >= kMaxProcesses && !entries_.contains(message.process)) return std::nullopt;
  Entry& entry = entries_[message.process];
  entry.heard = now;
  entry.reason = message.state_text;
  const std::string before = std::exchange(entry.state, state_name(message.state));
  if (before == entry.state) return std::nullopt;
  return Change{message.process, before, entry.state, entry.reason};
}

std::vector<ProcessTable::Change> ProcessTable::silent_since(TimePoint now) {
  std::vector<Change> changes;
  for (auto& [process, entry] : entries_) {
    if (now - entry.heard < kSilence || entry.state == kSilentState) continue;
    changes.push_back({process, std::exchange(entry.state, kSilentState), kSilentState, "no word from it"});
    entry.reason = changes.back().reason;
  }
  return changes;
}

std::vector<ProcessTable::Row> ProcessTable::rows() const {
  std::vector<Row> rows;
  for (const auto& [process, entry] : entries_) rows.push_back({process, entry.state, entry.reason});
  return rows;
}

}  // namespace ignis
