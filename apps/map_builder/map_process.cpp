// SPDX-License-Identifier: Apache-2.0
#include "map_builder/map_process.h"

#include <algorithm>
#include <format>
#include <iostream>
#include <utility>

#include "ignis/keyframe_request_t.hpp"
#include "map_builder/part_queue.h"
#include "runtime/channels.h"
#include "runtime/stop_signal.h"

namespace ignis {
namespace {

namespace channels = runtime::channels;
using std::chrono::milliseconds;

constexpr milliseconds kHudPeriod{100};
constexpr std::chrono::seconds kReportPeriod{1};
constexpr std::size_t kMaxRequestedIds = 32;
constexpr int kHealthQueue = 100;
constexpr std::chrono::seconds kRefusalTold{3};
constexpr std::chrono::seconds kLossTold{60};

double seconds(std::chrono::steady_clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

std::string given_up_text(std::int64_t keyframes) {
  return std::format("the clouds of {} keyframes are given up: nobody sends them again", keyframes);
}

/// What stands behind the state in HEALTH; empty while nothing was dropped.
std::string drops_text(std::int64_t clouds) {
  if (clouds == 0) return {};
  return std::format("; map.max_keyframe_points is reached, the {} farthest keyframe clouds are dropped", clouds);
}

std::string refusal_text(const HudData& hud) {
  std::string text = std::format("{} clouds and {} poses refused", hud.refused_clouds, hud.refused_poses);
  if (hud.refused_points > 0) text += std::format(", and {} points that no map can hold", hud.refused_points);
  return text;
}

double now_s() { return seconds(std::chrono::steady_clock::now().time_since_epoch()); }

}  // namespace

MapProcess::MapProcess(const runtime::Application& application, const runtime::HmiConfig& hmi,
                       const std::filesystem::path& journal_folder)
    : map_config_(application.config.map),
      link_(application),
      server_(hmi, stream_terms(map_config_, hmi)),
      lasting_(map_config_, journal_folder),
      frame_period_(
          std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / hmi.frame_rate_hz))),
      refusals_(kRefusalTold),
      other_sessions_(kRefusalTold),
      given_up_(kLossTold),
      drops_(kLossTold) {
  hud_.map.address = server_.address();
  hud_.band_radii = {map_config_.local_window_m, map_config_.mid_window_m, map_config_.coarse_window_m};
  subscribe(application.config.lcm);
}

void MapProcess::subscribe(const runtime::LcmConfig& lcm) {
  const auto remember = [this](const runtime::ReceiverCounts& counts) { receivers_.push_back(&counts); };
  const int parts = part_queue(lcm.keyframe_queue);
  remember(link_.subscribe<cloud_t>(channels::kCloud, lcm.cloud_queue, [this](const cloud_t& message) {
    if (const auto cloud = clouds_.add(message)) on_cloud(*cloud);
  }));
  remember(link_.subscribe<cloud_t>(
      channels::kCloudAgain, lcm.cloud_queue,
      [this](const cloud_t& message) {
        if (const auto cloud = clouds_again_.add(message)) on_cloud_again(*cloud);
      },
      runtime::Senders::kSeveral));
  keyframe_counts_ = &link_.subscribe<keyframe_t>(channels::kKeyframe, parts, [this](const keyframe_t& message) {
    if (const auto keyframe = keyframes_.add(message)) on_keyframe(*keyframe);
  });
  remember(*keyframe_counts_);
  remember(link_.subscribe<smoothed_keyframes_t>(channels::kSmoothedKeyframes, parts,
                                                 [this](const smoothed_keyframes_t& message) {
                                                   if (const auto revision = revisions_.add(message)) {
                                                     on_revision(*revision);
                                                   }
                                                 }));
  remember(link_.subscribe<loop_result_t>(channels::kLoopResult, lcm.keyframe_queue,
                                          [this](const loop_result_t& message) { on_loop(message); }));
  remember(link_.subscribe<scan_stats_t>(channels::kScanStats, lcm.cloud_queue,
                                         [this](const scan_stats_t& message) { on_scan_stats(message); }));
  remember(link_.subscribe<state_t>(channels::kState, lcm.state_queue,
                                    [this](const state_t& message) { on_state(message); }));
  remember(link_.subscribe<health_t>(
      channels::kHealth, kHealthQueue, [this](const health_t& message) { on_health(message); },
      runtime::Senders::kSeveral));
}

/// Whether a message is of the session that is shown, which the first one of all decides.
bool MapProcess::accept_session(std::int32_t session) {
  if (!session_) session_ = session;
  if (session == *session_) return true;
  ++hud_.refused_of_other_sessions;
  return false;
}

/// A new odom frame: nothing of the old map can be placed in it.
void MapProcess::begin_session(std::int32_t session) {
  session_ = session;
  lasting_.begin_session(session);
  missed_ = {};
  loops_.clear();
  graph_keyframes_ = 0;
  keyframe_requests_.begin_session();
  hud_.loops_accepted = 0;
  hud_.loops_withdrawn = 0;
  ++resets_;
  map_changed_ = loops_changed_ = keyframes_changed_ = true;
  next_paths_ = {};
  events_.session(hud_.map.utime, session);
}

/// Looked at before the session is: what is damaged must not end the drive that is shown.
bool MapProcess::refuse_pose(const Pose& pose) {
  if (usable(pose)) return false;
  ++refused_messages_;
  return true;
}

void MapProcess::on_cloud(const messages::PosedCloud& cloud) {
  if (!usable(cloud.T_odom_body)) {
    ++hud_.refused_clouds;
    return;
  }
  if (lasting_.waits_for_scan()) session_ = cloud.session;
  // The front end's next session begins with a scan. Any other one takes a keyframe: it says more of where it belongs.
  if (session_ && std::int64_t{cloud.session} == std::int64_t{*session_} + 1) begin_session(cloud.session);
  if (!accept_session(cloud.session)) return;
  const auto got_on = [this] { link_.got_on(); };
  if (const LastingMap::Beginning beginning = lasting_.begin_with(cloud, got_on); !beginning.note.empty()) {
    std::cerr << "map_builder: " << beginning.note << std::endl;
    keyframes_changed_ = true;
    journal_damage_ = beginning.damage;
    journal_damage_s_ = now_s();
    if (beginning.newest) missed_.begin(*beginning.newest, cloud.sequence, now_s());
  }
  if (missed_.waiting()) {
    missed_.hold(cloud, now_s());
    catch_up();
  } else {
    insert(cloud);
  }
}

void MapProcess::on_cloud_again(const messages::PosedCloud& cloud) {
  if (!missed_.waiting() || cloud.session != session_ || !usable(cloud.T_odom_body)) return;
  missed_.hold_again(cloud, now_s());
  catch_up();
}

/// Asks for the scans of a restart, and goes on with them once they are there.
void MapProcess::catch_up() {
  if (!missed_.waiting()) return;
  if (std::vector<std::int32_t> numbers = missed_.ask(now_s()); !numbers.empty()) {
    request(channels::kCloudRequest, std::move(numbers));
  }
  for (const MapInput& input : missed_.take(now_s())) {
    std::visit([this](const auto& each) { insert(each); }, input);
    link_.got_on();
  }
}

void MapProcess::insert(const messages::PosedCloud& cloud) {
  const InsertCounts counts = timed(budget_.insertion, [&] { return lasting_.insert_scan(cloud); });
  if (!cloud.points.empty() && counts.rejected == cloud.points.size()) {
    ++hud_.refused_clouds;
    return;
  }
  hud_.map.utime = cloud.utime;
  ++hud_.map.clouds_inserted;
  map_changed_ = true;
}

void MapProcess::on_keyframe(const Keyframe& keyframe) {
  if (refuse_pose(keyframe.state.T_odom_body)) return;
  if (lasting_.waits_for_scan()) return;
  // A front end that starts cold counts sessions from 0, so a smaller number is as good as a greater one.
  if (keyframe.id >= 0 && session_ && keyframe.session != *session_) begin_session(keyframe.session);
  if (!accept_session(keyframe.session)) return;
  if (missed_.waiting()) {
    missed_.hold(keyframe);
  } else {
    insert(keyframe);
  }
}

void MapProcess::insert(const Keyframe& keyframe) {
  if (map_.is_of_another_drive(keyframe)) begin_session(keyframe.session);
  if (!lasting_.add_keyframe(keyframe)) return;
  events_.keyframe(keyframe.state.utime, keyframe.id);
  map_changed_ = keyframes_changed_ = true;
}

void MapProcess::on_revision(const messages::GraphRevision& revision) {
  if (refuse_pose(revision.T_map_odom) || !accept_session(revision.session)) return;
  std::vector<CorrectedPose> poses;
  poses.reserve(revision.poses.size());
  for (const KeyframePose& pose : revision.poses) poses.push_back({pose.id, pose.T_map_body});
  map_.correct(revision.T_map_odom, poses, revision.revision);
  graph_keyframes_ = revision.keyframes;
  map_changed_ = keyframes_changed_ = true;
}

void MapProcess::on_loop(const loop_result_t& loop) {
  if (!accept_session(loop.session)) return;
  hud_.loop = loop;
  hud_.has_loop = true;
  loops_changed_ |= loops_.record(loop);
  if (loop.accepted != 0) {
    ++hud_.loops_accepted;
    map_.add_loop(loop.from_id, loop.to_id);
  } else if (loop.reason == loop_result_t::WITHDRAWN || loop.stage == loop_result_t::STAGE_WITHDRAWN) {
    ++hud_.loops_withdrawn;
    map_.remove_loop(loop.from_id, loop.to_id);
  }
  events_.loop(loop);
  map_changed_ = true;
  next_paths_ = {};  // the way driven is about to move
}

void MapProcess::on_scan_stats(const scan_stats_t& scan) {
  hud_.scan = scan;
  hud_.has_scan = true;
  ++(scan.applied != 0 ? hud_.scans_applied : hud_.scans_rejected);
  events_.scan(scan);
}

void MapProcess::on_state(const state_t& state) {
  if (refuse_pose(messages::from_message(state).T_odom_body)) return;
  hud_.state = state;
  hud_.has_state = true;
  hud_.T_map_body = map_.T_map_odom() * messages::from_message(state).T_odom_body;
  last_state_ = Clock::now();
}

void MapProcess::on_health(const health_t& health) {
  if (const auto change = processes_.record(health, Clock::now())) events_.process(hud_.map.utime, *change);
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
    catch_up();
    start_or_finish_rebuild();
    answer_viewers();
    if (now >= next_frame) {
      next_frame = std::max(next_frame + frame_period_, now);
      make_pictures();
    }
    if (now >= next_hud) {
      next_hud = std::max(next_hud + kHudPeriod, now);
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
    // After a new session there is nothing left that this map shows.
    if (map_.rebuilding()) {
      hud_.map.last_rebuild_ms = rebuilt.milliseconds;
      budget_.rebuild.add(rebuilt.milliseconds);
      events_.rebuild(hud_.map.utime, rebuilt.keyframes, rebuilt.milliseconds);
      map_.finish_rebuild(std::move(rebuilt.map));
      map_changed_ = true;
      next_paths_ = {};
    }
  }
  if (!map_.needs_rebuild()) return;
  rebuild_ = std::async(std::launch::async, [job = map_.begin_rebuild()] {
    const auto began = Clock::now();
    ThreeLevelMap built = rebuild(job);
    return Rebuilt{std::move(built), static_cast<int>(job.clouds.size()), 1e3 * seconds(Clock::now() - began)};
  });
}

void MapProcess::update_status() {
  const ThreeLevelMap& voxels = map_.voxels();
  hud_.map.voxels_local = static_cast<std::int32_t>(voxels.size(0));
  hud_.map.voxels_mid = static_cast<std::int32_t>(voxels.size(1));
  hud_.map.voxels_coarse = static_cast<std::int32_t>(voxels.size(2));
  budget_.voxel_bytes = voxels.bytes();
  budget_.cloud_bytes = map_.clouds().bytes();
  hud_.map.bytes = static_cast<std::int64_t>(budget_.voxel_bytes + budget_.cloud_bytes);
  hud_.map.keyframes = static_cast<std::int32_t>(map_.clouds().size());
  hud_.map.rebuilds = map_.rebuilds();
  hud_.map.clients = server_.clients();
  hud_.map.frames_sent = server_.counters().snapshots + server_.counters().deltas;
  hud_.map.frames_skipped = server_.counters().pictures_skipped;
  hud_.map.revision = map_.revision();
  hud_.rebuilding = map_.rebuilding();
  hud_.state_age_s = seconds(Clock::now() - last_state_);
  hud_.refused_poses = refused_messages_ + map_.refused_poses();
  hud_.refused_points = map_.refused_points();
  hud_.keyframes_given_up = keyframe_requests_.given_up();
  keyframe_counts_->queue_drops = keyframes_.incomplete() + hud_.keyframes_given_up;
  hud_.messages_lost = clouds_.incomplete() + keyframes_.incomplete() + revisions_.incomplete();
  hud_.messages_repeated = keyframes_.repeated();
  hud_.messages_received = 0;
  for (const runtime::ReceiverCounts* receiver : receivers_) {
    hud_.messages_lost += receiver->lost;
    hud_.messages_received += receiver->received;
  }
  for (const ProcessTable::Change& change : processes_.silent_since(Clock::now())) {
    events_.process(hud_.map.utime, change);
  }
  hud_.processes = processes_.rows();
}

/// Why the map is not what it should be; empty while it is.
std::string MapProcess::trouble() {
  const auto now = Clock::now();
  const bool session_trouble = other_sessions_.look(hud_.refused_of_other_sessions, now);
  const bool refusal = refusals_.look(hud_.refused_clouds + hud_.refused_poses + hud_.refused_points, now);
  const bool loss = given_up_.look(hud_.keyframes_given_up, now);
  // A long drive drops clouds by and by: that it begins to is news, what follows stands beside OK.
  const bool first_drop = drops_.look(std::min<std::int64_t>(map_.clouds().dropped(), 1), now);
  if (std::string failure = lasting_.failure(); !failure.empty()) return failure;
  if (map_.voxels().coarsening() > 0) return "map.max_voxels is reached, the finest level is left out";
  if (std::string missing = missed_.trouble(now_s()); !missing.empty()) return missing;
  if (!journal_damage_.empty() && now_s() - journal_damage_s_ < MissedScans::kTold_s) return journal_damage_;
  if (session_trouble) {
    return std::format("{} messages of another session than {} refused", hud_.refused_of_other_sessions,
                       session_.value_or(0));
  }
  if (refusal) return refusal_text(hud_);
  if (loss) return given_up_text(hud_.keyframes_given_up);
  return first_drop ? "a bound of memory is reached" : "";
}

void MapProcess::report() {
  update_status();
  const std::string why = trouble();
  // A disk that takes nothing needs a person.
  const bool fault = !why.empty() && why == lasting_.failure();
  const std::int8_t state = why.empty() ? health_t::OK : (fault ? health_t::FAULT : health_t::DEGRADED);
  hud_.health = (why.empty() ? "OK" : (fault ? "FAULT: " : "DEGRADED: ") + why) + drops_text(map_.clouds().dropped());
  ViewUpdate update;
  update.api_status = shared(status_json(hud_, budget_, server_.counters(), pictures_, loops_.text()));
  server_.publish(std::move(update));
  link_.publish(channels::kMapStatus, hud_.map);
  ++hud_.map.sequence;
  link_.report_health(hud_.map.utime, state, hud_.health, resets_);
}

void MapProcess::request_missing_keyframes() {
  // The newest ones may still be on their way. How many there are is another's word: no list that long is made.
  std::vector<std::int32_t> ids = map_.missing_keyframes(
      graph_keyframes_ - 1, kMaxRequestedIds, [this](std::int32_t id) { return keyframe_requests_.allow(id); });
  if (!ids.empty()) request(channels::kKeyframeRequest, std::move(ids));
  if (const std::int64_t given_up = keyframe_requests_.given_up(); given_up > 2 * given_up_told_) {
    given_up_told_ = given_up;
    std::cerr << std::format("map_builder: {}\n", given_up_text(given_up));
  }
}

void MapProcess::request(const char* channel, std::vector<std::int32_t> ids) {
  keyframe_request_t message;
  message.utime = hud_.map.utime;
  message.sequence = request_sequence_++;
  message.session = session_.value_or(0);
  message.sender = "map_builder";
  message.num_ids = static_cast<std::int32_t>(ids.size());
  message.ids = std::move(ids);
  link_.publish(channel, message);
}

}  // namespace ignis
