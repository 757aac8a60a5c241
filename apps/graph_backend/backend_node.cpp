// SPDX-License-Identifier: Apache-2.0
#include "backend_node.h"

#include <format>

#include "runtime/channels.h"

namespace ignis {
namespace {

using runtime::LcmLink;
namespace channels = runtime::channels;

constexpr int kPollMs = 100;
constexpr Utime kSmoothedStatePeriod = 20'000;  // [us]
constexpr std::chrono::milliseconds kRequestPeriod{300};
constexpr std::chrono::seconds kFullPeriod{2};  // late joiners get the whole set within this time
constexpr std::size_t kMaxIdsPerRequest = 16;
constexpr int kMaxRequests = 20;  // for one gap; then the front end has it no longer either

}  // namespace

BackendNode::BackendNode(const runtime::Application& application) : config_(application.config), link_(application) {
  keyframe_counts_ = &link_.subscribe<keyframe_t>(channels::kKeyframe, config_.lcm.keyframe_queue,
                                                  [this](const keyframe_t& part) { on_keyframe_part(part); });
  link_.subscribe<state_t>(channels::kState, config_.lcm.imu_queue,
                           [this](const state_t& message) { on_state(message); });
}

void BackendNode::spin_once() {
  link_.handle(kPollMs);
  request_missing_keyframes();
  if (smoother_ && std::chrono::steady_clock::now() - last_full_ > kFullPeriod) {
    SmootherUpdate everything = last_update_;
    everything.moved = smoother_->all_poses();
    publish_revision(everything, true);
  }
  publish_health();
}

void BackendNode::on_keyframe_part(const keyframe_t& part) {
  std::optional<Keyframe> keyframe = assembler_.add(part);
  if (!keyframe) return;
  if (keyframe->session != session_) begin_session(keyframe->session);
  if (keyframe->id < smoother_->expected_id()) return;  // a repeat that somebody else asked for
  waiting_.insert_or_assign(keyframe->id, std::move(*keyframe));
  add_waiting_keyframes();
}

void BackendNode::begin_session(std::int32_t session) {
  session_ = session;
  waiting_.clear();
  smoother_ = std::make_unique<Smoother>(config_.backend, config_.frontend.loop_gates);
  T_map_odom_ = Pose{};
  fault_.clear();
}

void BackendNode::add_waiting_keyframes() {
  while (!waiting_.empty() && waiting_.begin()->first <= smoother_->expected_id()) {
    const Keyframe keyframe = std::move(waiting_.begin()->second);
    waiting_.erase(waiting_.begin());
    take_keyframe(keyframe);
  }
}

void BackendNode::take_keyframe(const Keyframe& keyframe) {
  const SmootherUpdate update = smoother_->add_keyframe(keyframe);
  newest_utime_ = std::max(newest_utime_, keyframe.state.utime);
  fault_ = update.accepted() ? "" : std::format("keyframe {} refused: {}", keyframe.id, update.reason);
  if (update.accepted()) publish_update(update, keyframe);
}

void BackendNode::publish_update(const SmootherUpdate& update, const Keyframe& keyframe) {
  last_update_ = update;
  last_update_.newest.utime = keyframe.state.utime;
  T_map_odom_ = update.T_map_odom;
  publish_revision(last_update_, false);
  if (update.loop) publish_loop(*update.loop);
  for (const LoopResult& withdrawn : update.withdrawn) publish_loop(withdrawn);
}

void BackendNode::publish_revision(const SmootherUpdate& update, bool full) {
  if (full) last_full_ = std::chrono::steady_clock::now();
  messages::GraphRevision revision;
  revision.utime = newest_utime_;
  revision.session = session_;
  revision.revision = smoother_->revision();
  revision.full = full;
  revision.keyframes = smoother_->stats().keyframes;
  revision.newest_id = smoother_->expected_id() - 1;
  revision.T_map_odom = smoother_->T_map_odom();
  revision.covariance = update.covariance;
  revision.poses = update.moved;
  for (smoothed_keyframes_t& message : messages::to_messages(revision)) {
    message.sequence = revision_sequence_;
    link_.publish(channels::kSmoothedKeyframes, message);
  }
  ++revision_sequence_;
}

void BackendNode::publish_loop(const LoopResult& result) {
  loop_result_t message = messages::to_message(result, session_);
  message.sequence = loop_sequence_++;
  link_.publish(channels::kLoopResult, message);
}

void BackendNode::on_state(const state_t& message) {
  if (message.session != session_ || message.utime < last_smoothed_utime_ + kSmoothedStatePeriod) return;
  last_smoothed_utime_ = message.utime;
  NavState state = messages::from_message(message);
  state.T_odom_body = T_map_odom_ * state.T_odom_body;
  state.v_odom = T_map_odom_.rotation * state.v_odom;
  state_t smoothed = messages::to_message(state, session_, "map");
  smoothed.sequence = state_sequence_++;
  link_.publish(channels::kSmoothedState, smoothed);
}

void BackendNode::request_missing_keyframes() {
  if (waiting_.empty()) return;
  const auto now = std::chrono::steady_clock::now();
  if (now - last_request_ < kRequestPeriod) return;
  last_request_ = now;
  if (requested_id_ != smoother_->expected_id()) requests_ = 0;
  requested_id_ = smoother_->expected_id();
  if (++requests_ > kMaxRequests) {
    smoother_->accept_gap_before(waiting_.begin()->first);
    add_waiting_keyframes();
    return;
  }
  keyframe_request_t request{};
  request.utime = newest_utime_;
  request.sequence = request_sequence_++;
  request.session = session_;
  request.sender = "graph_backend";
  for (std::int32_t id = smoother_->expected_id();
       id < waiting_.rbegin()->first && request.ids.size() < kMaxIdsPerRequest; ++id) {
    if (!waiting_.contains(id)) request.ids.push_back(id);
  }
  request.num_ids = static_cast<std::int32_t>(request.ids.size());
  link_.publish(channels::kKeyframeRequest, request);
}

void BackendNode::publish_health() {
  keyframe_counts_->queue_drops = assembler_.incomplete();
  if (!fault_.empty()) {
    link_.report_health(newest_utime_, health_t::DEGRADED, fault_);
  } else if (!waiting_.empty()) {
    link_.report_health(newest_utime_, health_t::DEGRADED,
                        std::format("waiting for keyframe {}", smoother_->expected_id()));
  } else {
    link_.report_health(newest_utime_, health_t::OK, smoother_ ? "OK" : "OK: no keyframe yet");
  }
}

}  // namespace ignis
