// SPDX-License-Identifier: Apache-2.0
#include "replay_follower.h"

#include <format>
#include <utility>

namespace ignis {
namespace {

/// There is no journal to look up clouds in, and a replay shall find the loops of the vehicle, which has one.
constexpr double kCloudMemoryMb = 1e6;

BackendConfig for_replay(BackendConfig config, bool use_loops) {
  config.use_loop_closing = config.use_loop_closing && use_loops;
  config.cloud_memory_mb = kCloudMemoryMb;
  return config;
}

}  // namespace

ReplayFollower::ReplayFollower(const runtime::IgnisConfig& config, bool use_loops, GraphListener* listener,
                               std::int32_t session)
    : backend_config_(for_replay(config.backend, use_loops)),
      loop_gates_(config.frontend.loop_gates),
      smoother_(backend_config_, loop_gates_),
      map_(config.map),
      session_(session),
      listener_(listener) {
  map_.draw_at_rebuild();  // finish() does; nobody looks before
}

void ReplayFollower::take(const ScanResult& scan, double milliseconds) {
  result_.scans.push_back(scan.stats);
  result_.scan_times_ms.push_back(milliseconds);
  if (!scan.has_state) return;
  follow_session(scan.stats.session);
  result_.odometry.push_back({scan.state.utime, scan.state.T_odom_body});
  result_.states.push_back({scan.state, scan.covariance, scan.trust});
  if (scan.keyframe) take_keyframe(*scan.keyframe);
  map_timer_.time([&] { return map_.insert_scan(scan.cloud, scan.state.T_odom_body); });
}

void ReplayFollower::follow_session(std::int32_t session) {
  if (session == session_) return;
  session_ = session;
  ++result_.sessions;
  settle_graph();
  smoother_ = Smoother(backend_config_, loop_gates_);
  schedule_ = {};
  newest_keyframe_ = 0;
  map_.clear();
  keyframes_.clear();
  result_.loops.clear();
}

void ReplayFollower::take_keyframe(const Keyframe& sent) {
  for (const keyframe_t& part : messages::to_messages(sent)) {
    if (listener_ != nullptr) listener_->keyframe_sent(part);
    const std::optional<Keyframe> keyframe = assembler_.add(part);
    if (!keyframe) continue;
    map_.add_keyframe(*keyframe);
    adopt_due_optimum();
    const SmootherUpdate update = backend_timer_.time([&] { return smoother_.add_keyframe(*keyframe); });
    newest_keyframe_ = keyframe->state.utime;
    keyframes_[keyframe->id] = {keyframe->state.utime, keyframe->state.T_odom_body, keyframe->state.T_odom_body};
    if (update.loop) result_.loops.push_back(*update.loop);
    result_.loops.insert(result_.loops.end(), update.changed.begin(), update.changed.end());
    if (update.accepted()) {
      publish(update);
    } else {
      note_refusal(*keyframe, update.reason);
    }
  }
}

void ReplayFollower::note_refusal(const Keyframe& keyframe, const std::string& reason) {
  if (result_.keyframes_refused++ > 0) return;
  result_.first_refusal = std::format("{} of session {}: {}", keyframe.id, keyframe.session, reason);
}

void ReplayFollower::adopt_due_optimum() {
  if (!schedule_.adoption_due(smoother_.stats().keyframes)) return;
  schedule_.end();
  const int swaps = smoother_.stats().shadow_swaps;
  const SmootherUpdate update = smoother_.adopt(batch_timer_.time([&] { return solve(problem_); }));
  if (smoother_.stats().shadow_swaps != swaps) publish(update);
}

/// What the back end does with an update that it accepted.
void ReplayFollower::publish(const SmootherUpdate& update) {
  if (listener_ != nullptr) listener_->graph_changed(smoother_, update, session_, newest_keyframe_);
  correct_map(update);
  schedule_.note(update);
  if (!schedule_.begin_due()) return;
  schedule_.begin(smoother_.stats());
  problem_ = smoother_.shadow_problem();
}

void ReplayFollower::correct_map(const SmootherUpdate& update) {
  if (update.loop && update.loop->accepted()) map_.add_loop(update.loop->from_id, update.loop->to_id);
  for (const LoopResult& loop : update.changed) {
    if (loop.accepted()) map_.add_loop(loop.from_id, loop.to_id);
    if (loop.reason == LoopReason::kWithdrawn) map_.remove_loop(loop.from_id, loop.to_id);
  }
  std::vector<CorrectedPose> poses;
  poses.reserve(update.moved.size());
  for (const KeyframePose& pose : update.moved) poses.push_back({pose.id, pose.T_map_body});
  map_.correct(update.T_map_odom, poses);
}

void ReplayFollower::rebuild_map() {
  map_timer_.time([&] {
    const RebuildJob job = map_.begin_rebuild();
    map_.finish_rebuild(rebuild(job));
  });
}

/// Places the poses of this session where its graph has them in the end.
void ReplayFollower::settle_graph() {
  if (result_.solver_failure.empty()) result_.solver_failure = smoother_.stats().solver_failure;
  result_.optimum = batch_timer_.time([&] { return solve(smoother_.shadow_problem()); });
  correct_map(smoother_.adopt(result_.optimum));
  std::vector<KeyframeCorrection> corrections;
  for (const KeyframePose& pose : smoother_.all_poses()) {
    KeyframeCorrection& keyframe = keyframes_.at(pose.id);
    keyframe.T_map_body = pose.T_map_body;
    corrections.push_back(keyframe);
  }
  const auto placed = static_cast<std::ptrdiff_t>(result_.smoothed.size());
  const Trajectory session(result_.odometry.begin() + placed, result_.odometry.end());
  const Trajectory smoothed = corrected_trajectory(session, corrections);
  result_.smoothed.insert(result_.smoothed.end(), smoothed.begin(), smoothed.end());
}

ReplayResult ReplayFollower::finish() {
  settle_graph();
  rebuild_map();
  result_.map_refusals = map_.refused_poses();
  result_.graph = smoother_.pose_graph();
  result_.smoother = smoother_.stats();
  return std::move(result_);
}

}  // namespace ignis
