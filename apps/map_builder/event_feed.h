// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "ignis/loop_result_t.hpp"
#include "ignis/scan_stats_t.hpp"
#include "map_builder/process_table.h"
#include "map_builder/stream_texts.h"

namespace ignis {

/// Turns what happens into the events that operators read: one sentence each, and no flood. Events wait here until they
/// are taken for the board.
class EventFeed {
 public:
  void session(Utime utime, std::int32_t session);
  void keyframe(Utime utime, std::int32_t id);
  /// A run of rejected scans is one event at its begin and one at its end.
  void scan(const scan_stats_t& scan);
  /// Loops that were never confirmed are no events.
  void loop(const loop_result_t& loop);
  void process(Utime utime, const ProcessTable::Change& change);
  void rebuild(Utime utime, int keyframes, double milliseconds);

  [[nodiscard]] std::vector<SharedBytes> take();

 private:
  void add(Utime utime, const char* kind, const std::string& text, EventLevel level = EventLevel::kInfo);

  std::vector<SharedBytes> waiting_;
  std::string rejected_because_;  // empty: the last scan was applied
  int rejected_in_a_row_ = 0;
};

}  // namespace ignis
