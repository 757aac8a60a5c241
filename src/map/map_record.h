// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/keyframe.h"
#include "map/live_map.h"

/// What a map is made of, one record for each keyframe and each scan that said something new, so that a killed process
/// is succeeded by one with the same clouds. The bytes of a record are the payload of common/byte_record.h; files stand
/// in apps/map_builder.
namespace ignis {

inline constexpr std::uint32_t kMapRecordVersion = 2;

/// What the records of one file belong to. Another version, configuration or session makes them useless.
struct MapRecordHead {
  std::uint32_t version = kMapRecordVersion;
  std::string config_fingerprint;  ///< of what decides the clouds
  std::int32_t session = 0;        ///< of the front end

  friend bool operator==(const MapRecordHead&, const MapRecordHead&) = default;
};

/// A call of LiveMap::insert_scan or LiveMap::add_keyframe.
struct MapRecord {
  std::int32_t id = KeyframeClouds::kBeforeFirst;  ///< of the keyframe, or of the one that the scan was added to
  bool is_keyframe = false;
  bool is_late = false;     ///< a keyframe that came after a successor
  Utime utime = 0;          ///< [us] of the pose
  std::int32_t number = 0;  ///< running number of the newest cloud that the map had then
  Pose T_odom_body;
  std::vector<CloudPoint> points;  ///< [m] body frame, those that the map keeps; where it carves, all
};

[[nodiscard]] std::vector<std::byte> encode(const MapRecordHead& head);
[[nodiscard]] std::vector<std::byte> encode(const MapRecord& record);

/// Any bytes at all.
[[nodiscard]] std::optional<MapRecordHead> decode_head(std::span<const std::byte> payload);
[[nodiscard]] std::optional<MapRecord> decode_record(std::span<const std::byte> payload);

/// The call that `map` has just carried out, with the points that it kept. Nothing when it kept none and nothing hangs
/// on the pose either.
[[nodiscard]] std::optional<MapRecord> record_of_scan(const LiveMap& map, std::span<const CloudPoint> points_body,
                                                      Utime utime, const Pose& T_odom_body);
[[nodiscard]] MapRecord record_of_keyframe(const LiveMap& map, const Keyframe& keyframe);

/// Carries the calls out again in a map without clouds, whatever order they come in, and draws once at the end. Poses
/// of the back end that the map knows already are used. What the keyframe of its file is missing for is left out.
/// `got_on` is called after each record and each cloud that is drawn.
void restore(LiveMap& map, std::vector<MapRecord> records, const std::function<void()>& got_on = {});

}  // namespace ignis
