// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/byte_record.h"

/// The journal of the graph as bytes: a head, then one record per change of the graph, appended and never altered. A
/// record is that of common/byte_record.h, its payload what ChangeTracker makes. Files stand in apps/graph_backend.
namespace ignis {

inline constexpr std::uint32_t kJournalVersion = 9;

/// What a journal belongs to. Another version, configuration or session makes it useless to a back end.
struct JournalHead {
  std::uint32_t version = kJournalVersion;
  std::string config_fingerprint;  ///< of what decides the graph
  std::int32_t session = 0;        ///< of the front end

  friend bool operator==(const JournalHead&, const JournalHead&) = default;
};

/// What could be read. Everything before the first damage is kept.
struct JournalContents {
  bool is_journal = false;  ///< the head is whole
  JournalHead head;
  std::vector<std::span<const std::byte>> payloads;  ///< of whole records, within the bytes that were read
  std::size_t whole_bytes = 0;                       ///< where the head and these records end
  std::string damage;                                ///< what stands behind them; empty when nothing does

  bool torn_tail = false;  ///< the damage looks like one write that was cut short
};

[[nodiscard]] std::vector<std::byte> encode_head(const JournalHead& head);

/// Any bytes at all.
[[nodiscard]] JournalContents read_journal(std::span<const std::byte> bytes);

}  // namespace ignis
