// SPDX-License-Identifier: Apache-2.0
#include "map_builder/hud.h"

#include <numbers>

#include <nlohmann/json.hpp>

#include "map/voxel_checksum.h"
#include "map_builder/stream_counters.h"

namespace ignis {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kDegrees = 180.0 / std::numbers::pi;

Json vector_json(const Eigen::Vector3d& vector) { return {vector.x(), vector.y(), vector.z()}; }

Json state_json(const HudData& data) {
  const state_t& state = data.state;
  const Eigen::Quaterniond& q = data.T_map_body.rotation;
  return {{"utime", state.utime},
          {"session", state.session},
          {"age_s", data.state_age_s},
          {"position", vector_json(data.T_map_body.translation)},
          {"quaternion", {q.w(), q.x(), q.y(), q.z()}},
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
          {"refused",
           {{"clouds", data.refused_clouds},
            {"poses", data.refused_poses},
            {"points", data.refused_points},
            {"of_other_sessions", data.refused_of_other_sessions}}},
          {"keyframes_given_up", data.keyframes_given_up},
          {"health", data.health},
          {"bands_m", data.band_radii}};
}

Json processes_json(const HudData& data) {
  Json list = Json::array();
  for (const ProcessTable::Row& row : data.processes) {
    list.push_back({{"process", row.process}, {"state", row.state}, {"reason", row.reason}});
  }
  return list;
}

Json link_json(const HudData& data) {
  return {{"lost", data.messages_lost},
          {"repeated", data.messages_repeated},
          {"received", data.messages_received},
          {"age_s", data.has_state ? Json(data.state_age_s) : Json()}};
}

Json duration_json(const DurationStats& stats) {
  return {
      {"count", stats.count()}, {"median", stats.quantile(0.5)}, {"p99", stats.quantile(0.99)}, {"max", stats.max()}};
}

Json budget_json(const MapBudget& budget) {
  return {{"voxel_bytes", budget.voxel_bytes},
          {"cloud_bytes", budget.cloud_bytes},
          {"insertion_ms", duration_json(budget.insertion)},
          {"snapshot_ms", duration_json(budget.picture)},
          {"rebuild_ms", duration_json(budget.rebuild)}};
}

Json views_json(const std::map<double, SharedPicture>& pictures) {
  Json list = Json::array();
  for (const auto& [radius, picture] : pictures) {
    list.push_back({{"radius", radius},
                    {"revision", picture->revision},
                    {"counts", picture->counts},
                    {"checksum", checksum_text(picture->checksum)},
                    {"utime", picture->utime}});
  }
  return list;
}

Json stream_json(const StreamCounters& counters) {
  Json json{{"snapshots", counters.snapshots.load()},     {"deltas", counters.deltas.load()},
            {"frame_bytes", counters.frame_bytes.load()}, {"pictures_skipped", counters.pictures_skipped.load()},
            {"resyncs", counters.resyncs.load()},         {"most_waiting_bytes", counters.most_waiting_bytes.load()}};
  json["refused"] = {{"bad_requests", counters.bad_requests.load()},
                     {"protocol_errors", counters.protocol_errors.load()},
                     {"binary_messages", counters.binary_messages.load()},
                     {"invalid_texts", counters.invalid_texts.load()},
                     {"policy_closes", counters.policy_closes.load()},
                     {"oversized", counters.oversized.load()},
                     {"idle_closes", counters.idle_closes.load()},
                     {"upgrades", counters.refused_upgrades.load()},
                     {"http", counters.refused_http.load()}};
  return json;
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
  json["health"] = processes_json(data);
  json["link"] = link_json(data);
  return text_of(json);
}

std::string status_json(const HudData& data, const MapBudget& budget, const StreamCounters& counters,
                        const std::map<double, SharedPicture>& pictures, const std::string& loops) {
  Json json = map_json(data);
  json["address"] = data.map.address;
  json["utime"] = data.map.utime;
  json["session"] = data.state.session;
  json["views"] = views_json(pictures);
  json["budget"] = budget_json(budget);
  json["stream"] = stream_json(counters);
  json["loops"] = Json::parse(loops)["list"];
  json["processes"] = processes_json(data);
  json["link"] = link_json(data);
  return text_of(json) + '\n';
}

}  // namespace ignis
