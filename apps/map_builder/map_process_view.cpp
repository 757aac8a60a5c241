// SPDX-License-Identifier: Apache-2.0
//
// What the map process shows: pictures, paths, lists and the answers to viewers.
#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

#include "ignis/graph_command_t.hpp"
#include "map_builder/loop_clouds.h"
#include "map_builder/map_process.h"
#include "runtime/channels.h"

namespace ignis {
namespace {

namespace channels = runtime::channels;

// Complete paths are sent whenever they change, so a long drive's are sent less often.
constexpr double kPathBytesPerSecond = 15'000.0;
constexpr double kPathPointBytes = 12.0;
constexpr std::chrono::milliseconds kMinPathPeriod{300};

}  // namespace

void MapProcess::answer_viewers() {
  for (const ViewerRequest& asked : server_.take_requests()) {
    if (const auto* clouds = std::get_if<LoopCloudsRequest>(&asked.request)) answer_clouds(asked.viewer, *clouds);
    if (const auto* command = std::get_if<LoopCommandRequest>(&asked.request)) send_command(asked.viewer, *command);
  }
}

void MapProcess::answer_clouds(std::int64_t viewer, const LoopCloudsRequest& request) {
  const std::vector<Eigen::Vector3f> from = map_.placed_cloud(request.from_id);
  const std::vector<Eigen::Vector3f> to = map_.placed_cloud(request.to_id);
  if (from.empty() || to.empty()) {
    server_.answer(viewer, {shared(error_text("no_clouds", "the map holds no cloud of one of these keyframes")), {}});
    return;
  }
  LoopClouds clouds = encode_loop_clouds(request, from, to);
  server_.answer(viewer, {shared(std::move(clouds.text)), shared(std::move(clouds.bytes))});
}

void MapProcess::send_command(std::int64_t viewer, const LoopCommandRequest& request) {
  graph_command_t command;
  command.utime = hud_.map.utime;
  command.sequence = command_sequence_++;
  command.session = session_.value_or(-1);
  command.command = request.veto ? graph_command_t::VETO_LOOP : graph_command_t::WITHDRAW_LOOP;
  command.sender = "map_builder";
  command.from_id = request.from_id;
  command.to_id = request.to_id;
  link_.publish(channels::kGraphCommand, command);
  const nlohmann::ordered_json reply{{"type", "command"},
                                     {"command", request.veto ? "veto" : "withdraw"},
                                     {"from", request.from_id},
                                     {"to", request.to_id},
                                     {"sent", true}};
  server_.answer(viewer, {shared(reply.dump()), {}});
}

void MapProcess::refresh_paths() {
  loop_edges_ = std::make_shared<const std::vector<LoopEdge>>(map_.loop_edges());
  if (Clock::now() < next_paths_) return;
  odometry_path_ = std::make_shared<const std::vector<Eigen::Vector3f>>(map_.odometry_path());
  corrected_path_ = std::make_shared<const std::vector<Eigen::Vector3f>>(map_.corrected_path());
  const double bytes = 2.0 * kPathPointBytes * static_cast<double>(odometry_path_->size());
  const auto period = std::chrono::duration<double>(bytes / kPathBytesPerSecond);
  next_paths_ =
      Clock::now() + std::max<Clock::duration>(std::chrono::duration_cast<Clock::duration>(period), kMinPathPeriod);
}

void MapProcess::make_pictures() {
  ViewUpdate update;
  const bool view_changed = server_.take_view_changed();
  const std::set<double> radii = server_.view_radii();
  if ((view_changed || map_changed_) && !radii.empty()) {
    map_changed_ = false;
    ++picture_number_;
    refresh_paths();
    pictures_ = timed(budget_.picture, [&] {
      std::map<double, SharedPicture> pictures;
      std::erase_if(builders_, [&](const auto& entry) { return !radii.contains(entry.first); });
      for (const double radius : radii) {
        MapPicture picture = builders_.try_emplace(radius, radius).first->second.build(map_.voxels());
        picture.number = picture_number_;
        picture.utime = hud_.map.utime;
        picture.revision = map_.revision();
        picture.T_map_body = map_.T_map_body();
        picture.odometry_path = odometry_path_;
        picture.corrected_path = corrected_path_;
        picture.loop_edges = loop_edges_;
        pictures[radius] = std::make_shared<const MapPicture>(std::move(picture));
      }
      return pictures;
    });
    update.pictures = pictures_;
  }
  publish_news(std::move(update));
}

void MapProcess::publish_news(ViewUpdate update) {
  update.events = events_.take();
  update.session = session_.value_or(0);
  update.revision = map_.revision();
  if (std::exchange(loops_changed_, false)) update.loops = shared(loops_.text());
  if (std::exchange(keyframes_changed_, false)) {
    KeyframeList list{.revision = map_.revision(), .entries = {}};
    for (const auto& [id, position] : map_.keyframe_positions()) list.entries.push_back({id, position});
    update.keyframes = std::make_shared<const KeyframeList>(std::move(list));
  }
  server_.publish(std::move(update));
}

void MapProcess::send_hud() {
  update_status();
  ViewUpdate update;
  update.hud = shared(hud_json(hud_));
  server_.publish(std::move(update));
}

}  // namespace ignis
