// SPDX-License-Identifier: Apache-2.0
#include "map_builder/stream_texts.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "map/stream_encoding.h"
#include "map/voxel_checksum.h"
#include "runtime/version.h"

namespace ignis {
namespace {

using Json = nlohmann::ordered_json;

// A keyframe that moved less has not moved for the eye.
constexpr float kVisibleShift = 1e-3F;  // [m]

const char* text_of(EventLevel level) {
  switch (level) {
    case EventLevel::kWarn:
      return "warn";
    case EventLevel::kError:
      return "error";
    case EventLevel::kInfo:
      break;
  }
  return "info";
}

/// Keyframes of `now` that `before` lacks or has elsewhere; nothing when `before` has one that `now` lacks.
std::optional<std::vector<const KeyframeList::Entry*>> changed_entries(const KeyframeList& before,
                                                                       const KeyframeList& now) {
  std::vector<const KeyframeList::Entry*> changed;
  auto old = before.entries.begin();
  for (const KeyframeList::Entry& entry : now.entries) {
    if (old != before.entries.end() && old->id < entry.id) return std::nullopt;
    const bool known = old != before.entries.end() && old->id == entry.id;
    if (!known || (old->position - entry.position).norm() > kVisibleShift) changed.push_back(&entry);
    if (known) ++old;
  }
  if (old != before.entries.end()) return std::nullopt;
  return changed;
}

double in_millimetres(float metres) { return std::round(static_cast<double>(metres) * 1e3) / 1e3; }

}  // namespace

StreamTerms stream_terms(const MapConfig& map, const runtime::HmiConfig& hmi) {
  return {.server_version = runtime::version(),
          .cell_m = {map.local_cell_m, map.mid_cell_m, map.coarse_cell_m},
          .window_m = {map.local_window_m, map.mid_window_m, map.coarse_window_m},
          .max_view_radius_m = hmi.max_view_radius_m,
          .frame_rate_hz = hmi.frame_rate_hz};
}

std::string hello_text(const StreamTerms& terms, std::int32_t session, std::int32_t revision) {
  return Json{{"type", "hello"},
              {"version", kStreamVersion},
              {"server", terms.server_version},
              {"session", session},
              {"revision", revision},
              {"cell_m", terms.cell_m},
              {"window_m", terms.window_m},
              {"max_view_m", terms.max_view_radius_m},
              {"rate_hz", terms.frame_rate_hz}}
      .dump();
}

std::string frame_text(const MapPicture& picture, bool is_snapshot, std::int64_t sequence) {
  Json json{{"type", "frame"}, {"kind", is_snapshot ? "snapshot" : "delta"}, {"sequence", sequence}};
  if (!is_snapshot) json["base"] = sequence - 1;
  json["revision"] = picture.revision;
  json["counts"] = picture.counts;
  json["checksum"] = checksum_text(picture.checksum);
  json["utime"] = picture.utime;
  return json.dump();
}

std::optional<std::string> keyframes_text(const KeyframeList* before, const KeyframeList& now) {
  std::optional<std::vector<const KeyframeList::Entry*>> changed;
  if (before != nullptr) changed = changed_entries(*before, now);
  const bool full = !changed.has_value();
  if (full) {
    changed.emplace();
    for (const KeyframeList::Entry& entry : now.entries) changed->push_back(&entry);
  } else if (changed->empty()) {
    return std::nullopt;
  }
  Json ids = Json::array();
  Json positions = Json::array();
  for (const KeyframeList::Entry* entry : *changed) {
    ids.push_back(entry->id);
    for (const float coordinate : entry->position) positions.push_back(in_millimetres(coordinate));
  }
  Json json{{"type", "keyframes"}, {"revision", now.revision}};
  if (full) json["full"] = true;
  json["ids"] = std::move(ids);
  json["positions"] = std::move(positions);
  return json.dump();
}

std::string event_text(Utime utime, const char* kind, const std::string& text, EventLevel level) {
  // A text from the bus may hold anything; broken UTF-8 is replaced, since browsers close the socket on it.
  return Json{{"type", "event"}, {"utime", utime}, {"kind", kind}, {"text", text}, {"level", text_of(level)}}.dump(
      -1, ' ', false, Json::error_handler_t::replace);
}

std::string error_text(const char* code, const std::string& reason) {
  return Json{{"type", "error"}, {"code", code}, {"reason", reason}}.dump(-1, ' ', false,
                                                                          Json::error_handler_t::replace);
}

}  // namespace ignis
