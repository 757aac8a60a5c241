// SPDX-License-Identifier: Apache-2.0
#include "map/map_record.h"

#include <algorithm>
#include <set>
#include <tuple>
#include <utility>

#include "common/measurement_bytes.h"

namespace ignis {

// They stand in the structs' own namespace, where the codec's templates look for them.

void transfer(auto& io, FieldsOf<MapRecordHead> auto& head) {
  io.number(head.version);
  io.text(head.config_fingerprint);
  io.number(head.session);
}

void transfer(auto& io, FieldsOf<MapRecord> auto& record) {
  io.number(record.id);
  io.number(record.is_keyframe);
  io.number(record.is_late);
  io.number(record.utime);
  io.number(record.number);
  transfer(io, record.T_odom_body);
  io.list(record.points);
}

namespace {

std::vector<CloudPoint> kept_points(const LiveMap& map, std::span<const CloudPoint> points) {
  if (map.follows_rays()) return {points.begin(), points.end()};
  std::vector<CloudPoint> kept;
  kept.reserve(map.newest_kept().size());
  for (const std::uint32_t i : map.newest_kept()) kept.push_back(points[i]);
  return kept;
}

}  // namespace

std::vector<std::byte> encode(const MapRecordHead& head) { return to_bytes(head); }

std::vector<std::byte> encode(const MapRecord& record) { return to_bytes(record); }

std::optional<MapRecordHead> decode_head(std::span<const std::byte> payload) {
  return from_bytes<MapRecordHead>(payload);
}

std::optional<MapRecord> decode_record(std::span<const std::byte> payload) { return from_bytes<MapRecord>(payload); }

std::optional<MapRecord> record_of_scan(const LiveMap& map, std::span<const CloudPoint> points_body, Utime utime,
                                        const Pose& T_odom_body) {
  const std::optional<std::int32_t> open = map.clouds().open_id();
  // The first scan of all places what comes before the first keyframe, whatever it holds; and rays say something
  // where they hit nothing new.
  if (!open || (map.newest_kept().empty() && *open >= 0 && !map.follows_rays())) return std::nullopt;
  return MapRecord{.id = *open,
                   .is_keyframe = false,
                   .is_late = false,
                   .utime = utime,
                   .T_odom_body = T_odom_body,
                   .points = kept_points(map, points_body)};
}

MapRecord record_of_keyframe(const LiveMap& map, const Keyframe& keyframe) {
  return {.id = keyframe.id,
          .is_keyframe = true,
          .is_late = map.clouds().open_id() != keyframe.id,
          .utime = keyframe.state.utime,
          .T_odom_body = keyframe.state.T_odom_body,
          .points = kept_points(map, keyframe.cloud)};
}

void restore(LiveMap& map, std::vector<MapRecord> records, const std::function<void()>& got_on) {
  // Each keyframe with its scans behind it, and those that came late at the end, where they are late again.
  std::ranges::stable_sort(records, {},
                           [](const MapRecord& each) { return std::tuple(each.is_late, each.id, !each.is_keyframe); });
  std::set<std::int32_t> placed{KeyframeClouds::kBeforeFirst};
  map.draw_at_rebuild();
  for (MapRecord& record : records) {
    if (record.is_keyframe) {
      Keyframe keyframe;
      keyframe.id = record.id;
      keyframe.state.utime = record.utime;
      keyframe.state.T_odom_body = record.T_odom_body;
      keyframe.cloud = std::move(record.points);
      if (map.add_keyframe(keyframe)) placed.insert(record.id);
    } else if (placed.contains(record.id)) {
      map.insert_scan(record.points, record.T_odom_body);
    }
    if (got_on) got_on();
  }
  map.finish_rebuild(rebuild(map.begin_rebuild(), got_on));
}

}  // namespace ignis
