// SPDX-License-Identifier: Apache-2.0
#include "map_builder/event_feed.h"

#include <format>
#include <utility>

#include "map_builder/loop_table.h"

namespace ignis {

void EventFeed::add(Utime utime, const char* kind, const std::string& text, EventLevel level) {
  if (waiting_.size() >= ViewBoard::kMaxEvents) waiting_.erase(waiting_.begin());
  waiting_.push_back(std::make_shared<const std::string>(event_text(utime, kind, text, level)));
}

std::vector<SharedBytes> EventFeed::take() { return std::exchange(waiting_, {}); }

void EventFeed::session(Utime utime, std::int32_t session) {
  add(utime, "session", std::format("session {} begins: the map starts empty", session), EventLevel::kWarn);
  rejected_because_.clear();
}

void EventFeed::keyframe(Utime utime, std::int32_t id) { add(utime, "keyframe", std::format("keyframe {}", id)); }

void EventFeed::scan(const scan_stats_t& scan) {
  if (scan.applied != 0) {
    if (!std::exchange(rejected_because_, "").empty() && rejected_in_a_row_ > 1) {
      add(scan.utime, "scan_rejected", std::format("scans are applied again, after {}", rejected_in_a_row_));
    }
    rejected_in_a_row_ = 0;
    return;
  }
  ++rejected_in_a_row_;
  const std::string reason = scan.reason_text.empty() ? "no reason given" : scan.reason_text;
  if (rejected_because_ == reason) return;
  rejected_because_ = reason;
  add(scan.utime, "scan_rejected", std::format("scan {} rejected: {}", scan.scan_sequence, reason), EventLevel::kWarn);
}

void EventFeed::loop(const loop_result_t& loop) {
  const bool withdrawn = loop.stage == loop_result_t::STAGE_WITHDRAWN;
  if (!withdrawn && !is_in_graph(loop.stage)) return;
  add(loop.utime, "loop",
      std::format("loop {} to {}: {}{}{}", loop.from_id, loop.to_id, stage_name(loop.stage),
                  loop.reason_text.empty() ? "" : ", ", loop.reason_text),
      withdrawn ? EventLevel::kWarn : EventLevel::kInfo);
}

void EventFeed::process(Utime utime, const ProcessTable::Change& change) {
  const bool ok = change.now == "ok";
  if (change.before.empty() && ok) return;  // it has just started
  const bool is_front_end = change.process == "lio_frontend";
  const char* kind = is_front_end && change.now == "lost"                                ? "lost"
                     : is_front_end && change.before == "lost" && change.now != "silent" ? "found"
                                                                                         : "health";
  const EventLevel level = ok ? EventLevel::kInfo : change.now == "degraded" ? EventLevel::kWarn : EventLevel::kError;
  add(utime, kind, std::format("{} is {}: {}", change.process, change.now, change.reason), level);
}

void EventFeed::rebuild(Utime utime, int keyframes, double milliseconds) {
  add(utime, "rebuild", std::format("map rebuilt from {} keyframes in {:.0f} ms", keyframes, milliseconds));
}

}  // namespace ignis
