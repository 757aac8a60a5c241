// SPDX-License-Identifier: Apache-2.0
#include "map_builder/hud.h"

#include <numbers>

#include <nlohmann/json.hpp>

namespace ignis {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kDegrees = 180.0 / std::numbers::pi;

Json state_json(const HudData& data) {
  const state_t& state = data.state;
  return {{"utime", state.utime},
          {"session", state.session},
          {"age_s", data.state_age_s},
          {"yaw_deg", state.yaw * kDegrees},
          {"pitch_deg", state.pitch * kDegrees},
          {"roll_deg", state.roll * kDegrees},
          {"right_mps", state.velocity_right},
          {"up_mps", state.velocity_up},
          {"forward_mps", state.velocity_forward}};
}

Json scan_json(const HudData& data) {
  const scan_stats_t& scan = data.scan;
  return {{"applied", scan.applied != 0},
          {"reason", scan.reason_text},
          {"points", scan.points},
          {"matched", scan.matched},
          {"mean_innovation_m", scan.mean_innovation},
          {"correction_m", scan.correction_m},
          {"total_applied", data.scans_applied},
          {"total_rejected", data.scans_rejected}};
}

Json loop_json(const HudData& data) {
  const loop_result_t& loop = data.loop;
  return {{"keyframes", loop.keyframes},           {"candidates", loop.candidates},
          {"accepted", loop.accepted != 0},        {"reason", loop.reason_text},
          {"correction_m", loop.correction_m},     {"mean_residual_m", loop.mean_residual},
          {"total_accepted", data.loops_accepted}, {"total_withdrawn", data.loops_withdrawn}};
}

Json map_json(const HudData& data) {
  const map_status_t& map = data.map;
  return {{"revision", map.revision},
          {"voxels", {map.voxels_local, map.voxels_mid, map.voxels_coarse}},
          {"bytes", map.bytes},
          {"keyframes", map.keyframes},
          {"rebuilds", map.rebuilds},
          {"rebuilding", data.rebuilding},
          {"last_rebuild_ms", map.last_rebuild_ms},
          {"clouds_inserted", map.clouds_inserted},
          {"clients", map.clients},
          {"frames_sent", map.frames_sent},
          {"frames_skipped", map.frames_skipped},
          {"messages_lost", data.messages_lost},
          {"health", data.health},
          {"bands_m", data.band_radii}};
}

std::string text_of(const Json& json) {
  // A text from the bus may hold anything; broken UTF-8 is replaced, since browsers close the socket on it.
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

std::string hud_json(const HudData& data) {
  Json json = {{"type", "hud"}, {"map", map_json(data)}};
  json["state"] = data.has_state ? state_json(data) : Json();
  json["scan"] = data.has_scan ? scan_json(data) : Json();
  json["loop"] = data.has_loop ? loop_json(data) : Json();
  return text_of(json);
}

std::string status_json(const HudData& data) {
  Json json = map_json(data);
  json["address"] = data.map.address;
  json["utime"] = data.map.utime;
  return text_of(json) + '\n';
}

}  // namespace ignis
