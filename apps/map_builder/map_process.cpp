// SPDX-License-Identifier: Apache-2.0
#include "map_builder/map_process.h"

#include <format>

#include "ignis/keyframe_request_t.hpp"
#include "map/stream_encoding.h"
#include "runtime/channels.h"
#include "runtime/stop_signal.h"

namespace ignis {
namespace {

namespace channels = runtime::channels;
using std::chrono::milliseconds;

constexpr milliseconds kHudPeriod{100};
constexpr std::chrono::seconds kReportPeriod{1};
constexpr std::size_t kMaxRequestedIds = 32;
constexpr int kMaxRequests = 5;  // the front end keeps a ring: what it no longer has will never come

double seconds(std::chrono::steady_clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

}  // namespace

MapProcess::MapProcess(const runtime::Application& application, const runtime::HmiConfig& hmi)
    : map_config_(application.config.map),
      link_(application),
      server_(hmi),
      map_(map_config_),
      frame_period_(
          std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / hmi.frame_rate_hz))) {
  hud_.map.address = server_.address();
  hud_.band_radii = {map_config_.local_window_m, map_config_.mid_window_m, map_config_.coarse_window_m};
  subscribe(application.config.lcm);
}

void MapProcess::subscribe(const runtime::LcmConfig& lcm) {
  const auto remember = [this](const runtime::ReceiverCounts& counts) { receivers_.push_back(&counts); };
  remember(link_.subscribe<cloud_t>(channels::kCloud, lcm.cloud_queue, [this](const cloud_t& message) {
    if (const auto cloud = clouds_.add(message)) on_cloud(*cloud);
  }));
  remember(link_.subscribe<keyframe_t>(channels::kKeyframe, lcm.keyframe_queue, [this](const keyframe_t& message) {
    if (const auto keyframe = keyframes_.add(message)) on_keyframe(*keyframe);
  }));
  remember(link_.subscribe<smoothed_keyframes_t>(channels::kSmoothedKeyframes, lcm.keyframe_queue,
                                                 [this](const smoothed_keyframes_t& message) {
                                                   if (const auto revision = revisions_.add(message)) {
                                                     on_revision(*revision);
                                                   }
                                                 }));
  remember(link_.subscribe<loop_result_t>(channels::kLoopResult, lcm.keyframe_queue,
                                          [this](const loop_result_t& message) { on_loop(message); }));
  remember(link_.subscribe<scan_stats_t>(channels::kScanStats, lcm.cloud_queue, [this](const scan_stats_t& message) {
    hud_.scan = message;
    hud_.has_scan = true;
    ++(message.applied != 0 ? hud_.scans_applied : hud_.scans_rejected);
  }));
  remember(link_.subscribe<state_t>(channels::kState, lcm.state_queue, [this](const state_t& message) {
    hud_.state = message;
    hud_.has_state = true;
    last_state_ = Clock::now();
  }));
}

bool MapProcess::accept_session(std::int32_t session) {
  if (session_ && session < *session_) return false;
  if (session_ && session > *session_) {
    // A new odom frame: nothing of the old map can be placed in it.
    map_.clear();
    graph_keyframes_ = 0;
    request_counts_.clear();
    hud_.loops_accepted = 0;
    hud_.loops_withdrawn = 0;
    if (rebuild_.valid()) rebuild_ = {};
    ++resets_;
    map_changed_ = true;
  }
  session_ = session;
  return true;
}

void MapProcess::on_cloud(const messages::PosedCloud& cloud) {
  if (!accept_session(cloud.session)) return;
  const InsertCounts counts = map_.insert_scan(cloud.points, cloud.T_odom_body);
  if (!cloud.points.empty() && counts.rejected == cloud.points.size()) {
    ++refused_clouds_;
    return;
  }
  hud_.map.utime = cloud.utime;
  ++hud_.map.clouds_inserted;
  map_changed_ = true;
}

void MapProcess::on_keyframe(const Keyframe& keyframe) {
  if (accept_session(keyframe.session) && map_.add_keyframe(keyframe)) map_changed_ = true;
}

void MapProcess::on_revision(const messages::GraphRevision& revision) {
  if (!accept_session(revision.session)) return;
  std::vector<CorrectedPose> poses;
  poses.reserve(revision.poses.size());
  for (const KeyframePose& pose : revision.poses) poses.push_back({pose.id, pose.T_map_body});
  map_.correct(revision.T_map_odom, poses);
  hud_.map.revision = revision.revision;
  graph_keyframes_ = revision.keyframes;
  map_changed_ = true;
}

void MapProcess::on_loop(const loop_result_t& loop) {
  if (!accept_session(loop.session)) return;
  hud_.loop = loop;
  hud_.has_loop = true;
  if (loop.accepted != 0) {
    ++hud_.loops_accepted;
    map_.add_loop(loop.from_id, loop.to_id);
  } else if (loop.reason == loop_result_t::WITHDRAWN) {
    ++hud_.loops_withdrawn;
    map_.remove_loop(loop.from_id, loop.to_id);
  }
  map_changed_ = true;
}

void MapProcess::run() {
  auto next_frame = Clock::now();
  auto next_hud = next_frame;
  auto next_report = next_frame;
  while (!runtime::stop_requested()) {
    const auto wake = std::min({next_frame, next_hud, next_report});
    while (Clock::now() < wake && !runtime::stop_requested()) {
      const auto left = std::chrono::ceil<milliseconds>(wake - Clock::now()).count();
      link_.handle(static_cast<int>(std::max<std::int64_t>(left, 1)));
    }
    const auto now = Clock::now();
    start_or_finish_rebuild();
    if (now >= next_frame) {
      next_frame = now + frame_period_;
      send_frames();
    }
    if (now >= next_hud) {
      next_hud = now + kHudPeriod;
      send_hud();
    }
    if (now >= next_report) {
      next_report = now + kReportPeriod;
      report();
      request_missing_keyframes();
    }
  }
}

void MapProcess::start_or_finish_rebuild() {
  if (rebuild_.valid()) {
    if (rebuild_.wait_for(milliseconds(0)) != std::future_status::ready) return;
    Rebuilt rebuilt = rebuild_.get();
    hud_.map.last_rebuild_ms = rebuilt.milliseconds;
    map_.finish_rebuild(std::move(rebuilt.map));
    map_changed_ = true;
  }
  if (!map_.needs_rebuild()) return;
  rebuild_ = std::async(std::launch::async, [job = map_.begin_rebuild()] {
    const auto began = Clock::now();
    ThreeLevelMap built = rebuild(job);
    return Rebuilt{std::move(built), 1000.0 * seconds(Clock::now() - began)};
  });
}

void MapProcess::send_frames() {
  const bool view_changed = server_.take_view_changed();
  if (!view_changed && !map_changed_) return;
  const std::set<double> radii = server_.view_radii();
  if (radii.empty()) return;
  map_changed_ = false;
  StreamFrame frame{.T_map_body = map_.T_map_body(),
                    .levels = {},
                    .odometry_path = map_.odometry_path(),
                    .corrected_path = map_.corrected_path(),
                    .loop_edges = map_.loop_edges()};
  std::map<double, SharedBytes> frames;
  for (const double radius : radii) {
    frame.levels = map_.voxels().view(radius);
    frames[radius] = std::make_shared<const std::string>(encode_frame(frame));
  }
  server_.publish_frames(std::move(frames));
}

void MapProcess::update_status() {
  const ThreeLevelMap& voxels = map_.voxels();
  hud_.map.voxels_local = static_cast<std::int32_t>(voxels.level(0).size());
  hud_.map.voxels_mid = static_cast<std::int32_t>(voxels.level(1).size());
  hud_.map.voxels_coarse = static_cast<std::int32_t>(voxels.level(2).size());
  hud_.map.bytes = static_cast<std::int64_t>(voxels.bytes() + map_.clouds().bytes());
  hud_.map.keyframes = static_cast<std::int32_t>(map_.clouds().size());
  hud_.map.rebuilds = map_.rebuilds();
  hud_.map.clients = server_.clients();
  hud_.map.frames_sent = server_.counters().frames_sent;
  hud_.map.frames_skipped = server_.counters().frames_skipped;
  hud_.rebuilding = map_.rebuilding();
  hud_.state_age_s = seconds(Clock::now() - last_state_);
  hud_.messages_lost = clouds_.incomplete() + keyframes_.incomplete() + revisions_.incomplete();
  for (const runtime::ReceiverCounts* receiver : receivers_) hud_.messages_lost += receiver->lost;
}

void MapProcess::send_hud() {
  update_status();
  server_.publish_status(hud_json(hud_));
}

void MapProcess::report() {
  update_status();
  std::int8_t state = health_t::OK;
  hud_.health = "OK";
  if (map_.voxels().coarsened() > 0) {
    state = health_t::DEGRADED;
    hud_.health = "DEGRADED: map.max_voxels is reached, the finest level was coarsened";
  } else if (refused_clouds_ + map_.refused_poses() > 0) {
    state = health_t::DEGRADED;
    hud_.health = std::format("DEGRADED: {} clouds and {} poses refused", refused_clouds_, map_.refused_poses());
  }
  server_.set_api_status(status_json(hud_));
  link_.publish(channels::kMapStatus, hud_.map);
  ++hud_.map.sequence;
  link_.report_health(hud_.map.utime, state, hud_.health, resets_);
}

void MapProcess::request_missing_keyframes() {
  keyframe_request_t request;
  // The newest ones may still be on their way.
  for (const std::int32_t id : map_.missing_keyframes(graph_keyframes_ - 1)) {
    if (request.ids.size() < kMaxRequestedIds && request_counts_[id]++ < kMaxRequests) request.ids.push_back(id);
  }
  if (request.ids.empty()) return;
  request.utime = hud_.map.utime;
  request.sequence = request_sequence_++;
  request.session = session_.value_or(0);
  request.sender = "map_builder";
  request.num_ids = static_cast<std::int32_t>(request.ids.size());
  link_.publish(channels::kKeyframeRequest, request);
}

}  // namespace ignis
