// SPDX-License-Identifier: Apache-2.0
#include "backend_node.h"

#include <algorithm>
#include <format>
#include <iostream>
#include <utility>

#include "backend/keyframes/keyframe_check.h"
#include "backend_health.h"
#include "command_check.h"
#include "ignis/graph_command_t.hpp"
#include "messages/graph_revision.h"
#include "runtime/channels.h"

namespace ignis {
namespace {

using runtime::LcmLink;
namespace channels = runtime::channels;

constexpr int kPollMs = 100;
constexpr int kCommandQueue = 100;
// Parts of keyframes that wait in LCM while the solver is slow: 50 keyframes of an L1, 7 MB. LCM's buffer never
// shrinks, and what finds no place is asked for again.
constexpr int kMostWaitingParts = 200;
constexpr Utime kSmoothedStatePeriod = 20'000;  // [us]
constexpr std::chrono::seconds kFullPeriod{2};  // late joiners get the whole set within this time

LoopResult answer_to(const graph_command_t& command, std::string text) {
  LoopResult answer;
  answer.from_id = command.from_id;
  answer.to_id = command.to_id;
  answer.reason_text = std::move(text);
  return answer;
}

/// A command that changes nothing is answered too.
SmootherUpdate answered(SmootherUpdate update, const graph_command_t& command) {
  const auto is_about_it = [&](const LoopResult& loop) {
    return loop.from_id == command.from_id && loop.to_id == command.to_id;
  };
  if (update.loop || std::ranges::any_of(update.changed, is_about_it)) return update;
  update.loop = answer_to(command, command.command == graph_command_t::VETO_LOOP ? "vetoed; there was no such loop"
                                                                                 : "there is no such loop to withdraw");
  update.loop->utime = update.newest.utime;
  return update;
}

}  // namespace

BackendNode::BackendNode(const runtime::Application& application, const std::filesystem::path& journal_folder)
    : config_(application.config), link_(application), graph_(config_, journal_folder) {
  if (!graph_.resume_note().empty()) std::cerr << "graph_backend: " << graph_.resume_note() << std::endl;
  T_map_odom_ = graph_.smoother().T_map_odom();
  last_update_ = graph_.smoother().present();
  newest_utime_ = last_update_.newest.utime;
  keyframe_counts_ =
      &link_.subscribe<keyframe_t>(channels::kKeyframe, std::min(config_.lcm.keyframe_queue, kMostWaitingParts),
                                   [this](const keyframe_t& part) { on_keyframe_part(part); });
  state_counts_ = &link_.subscribe<state_t>(channels::kState, config_.lcm.imu_queue,
                                            [this](const state_t& message) { on_state(message); });
  link_.subscribe<graph_command_t>(
      channels::kGraphCommand, kCommandQueue, [this](const graph_command_t& command) { return on_command(command); },
      runtime::Senders::kSeveral);
}

void BackendNode::spin_once() {
  link_.handle(kPollMs);
  request_missing_keyframes();
  graph_.maintain();
  const bool has_keyframes = graph_.smoother().stats().keyframes > 0;
  if (has_keyframes && std::chrono::steady_clock::now() - last_full_ > kFullPeriod) publish_full_set();
  publish_health();
}

void BackendNode::on_keyframe_part(const keyframe_t& part) {
  std::optional<Keyframe> keyframe = assembler_.add(part);
  if (!keyframe) return;
  if (refuse_damaged(*keyframe)) return;
  if (keyframe->session != graph_.session() || graph_.smoother().is_of_another_drive(*keyframe)) {
    begin_session(keyframe->session);
  }
  const std::int32_t id = keyframe->id;
  const std::int32_t expected = graph_.smoother().expected_id();
  if (id < expected) return;  // a repeat that somebody else asked for
  if (!inbox_.put(std::move(*keyframe), expected, std::chrono::steady_clock::now())) {
    refusal_ = std::format("keyframe {} put aside: {} comes next", id, expected);
    ++keyframe_counts_->rejected;
  }
  add_waiting_keyframes();
}

/// A damaged keyframe says nothing about the drive that it comes from: it must not end the one in the graph, nor take
/// the place of the sound one with its id, which is asked for again.
bool BackendNode::refuse_damaged(const Keyframe& keyframe) {
  const std::string problem = keyframe_problem(keyframe);
  if (problem.empty()) return false;
  refusal_ = std::format("keyframe {} of session {} refused: {}", keyframe.id, keyframe.session, problem);
  ++keyframe_counts_->rejected;
  return true;
}

void BackendNode::begin_session(std::int32_t session) {
  graph_.begin_session(session);
  schedule_ = {};
  optimum_.drop();
  inbox_.clear();
  T_map_odom_ = Pose{};
  last_update_ = {};
  newest_state_.reset();
  last_smoothed_utime_ = 0;
  refusal_.clear();
}

void BackendNode::add_waiting_keyframes() {
  while (std::optional<Keyframe> keyframe = inbox_.take(graph_.smoother().expected_id())) {
    adopt_due_optimum();
    const SmootherUpdate update = graph_.change([&](Smoother& smoother) { return smoother.add_keyframe(*keyframe); });
    newest_utime_ = std::max(newest_utime_, keyframe->state.utime);
    refusal_ = update.accepted() ? "" : std::format("keyframe {} refused: {}", keyframe->id, update.reason);
    if (update.accepted()) publish_update(update);
    link_.got_on();
  }
}

/// Why it is refused, or "". Whatever is carried out is written to the journal and told to everybody.
const char* BackendNode::on_command(const graph_command_t& command) {
  if (command.session != -1 && command.session != graph_.session()) return "";
  if (!is_known(command)) return "there is no such command";
  if (!commands_.allow(std::chrono::steady_clock::now())) return "too many commands";
  if (command.command == graph_command_t::SEND_FULL_SET) {
    publish_full_set();
    return "";
  }
  if (!names_keyframes_of(graph_.smoother().all_poses(), command)) {
    constexpr const char* kUnknown = "the graph does not hold these two keyframes";
    publish_loop(answer_to(command, kUnknown));
    return kUnknown;
  }
  const SmootherUpdate update = graph_.change([&](Smoother& smoother) {
    return command.command == graph_command_t::VETO_LOOP ? smoother.veto_loop(command.from_id, command.to_id)
                                                         : smoother.withdraw_loop(command.from_id, command.to_id);
  });
  publish_update(answered(update, command));
  return "";
}

void BackendNode::adopt_due_optimum() {
  if (!schedule_.adoption_due(graph_.smoother().stats().keyframes)) return;
  schedule_.end();
  const ShadowOptimum optimum = optimum_.take([this] { link_.got_on(); });
  const int swaps = graph_.smoother().stats().shadow_swaps;
  const SmootherUpdate update = graph_.change([&](Smoother& smoother) { return smoother.adopt(optimum); });
  if (graph_.smoother().stats().shadow_swaps != swaps) publish_update(update);
}

/// After loops have entered or left, a batch solve in the background tells how far the incremental solution is from the
/// optimum.
void BackendNode::begin_due_optimum() {
  if (!schedule_.begin_due()) return;
  schedule_.begin(graph_.smoother().stats());
  optimum_.begin(graph_.shadow_problem());
}

void BackendNode::publish_update(const SmootherUpdate& update) {
  last_update_ = update;
  T_map_odom_ = update.T_map_odom;
  publish_revision(update, false);
  if (update.loop) publish_loop(*update.loop);
  for (const LoopResult& changed : update.changed) publish_loop(changed);
  schedule_.note(update);
  begin_due_optimum();
}

void BackendNode::publish_full_set() { publish_revision(last_update_, true); }

void BackendNode::publish_revision(const SmootherUpdate& update, bool full) {
  if (full) last_full_ = std::chrono::steady_clock::now();
  messages::GraphRevision revision = messages::revision_of(graph_.smoother(), update, graph_.session(), newest_utime_);
  if (full) messages::list_all(revision, graph_.smoother());
  for (smoothed_keyframes_t& message : messages::to_messages(revision)) {
    message.sequence = revision_sequence_;
    link_.publish(channels::kSmoothedKeyframes, message);
  }
  ++revision_sequence_;
}

void BackendNode::publish_loop(const LoopResult& result) {
  loop_result_t message = messages::to_message(result, graph_.session());
  message.sequence = loop_sequence_++;
  link_.publish(channels::kLoopResult, message);
}

/// What is not finite, leaps ahead alone or goes back is left out: stamps of SMOOTHED_STATE only increase.
bool BackendNode::is_next_state(const NavState& state) {
  if (!state.T_odom_body.all_finite() || !state.v_odom.allFinite() ||
      (newest_state_ && state_leaps_.leaps_ahead(*newest_state_, state.utime))) {
    ++state_counts_->rejected;
    return false;
  }
  if (newest_state_ && state.utime <= *newest_state_) return false;
  newest_state_ = state.utime;
  return true;
}

void BackendNode::on_state(const state_t& message) {
  if (message.session != graph_.session()) return;
  NavState state = messages::from_message(message);
  if (!is_next_state(state)) return;
  if (state.utime < last_smoothed_utime_ + kSmoothedStatePeriod) return;
  last_smoothed_utime_ = state.utime;
  state_t smoothed = messages::smoothed_state(state, graph_.session(), T_map_odom_);
  smoothed.sequence = state_sequence_++;
  link_.publish(channels::kSmoothedState, smoothed);
}

void BackendNode::request_missing_keyframes() {
  if (graph_.session() < 0) return;
  const std::int32_t expected = graph_.smoother().expected_id();
  if (const std::optional<std::int32_t> hopeless = inbox_.hopeless_before(expected)) {
    give_up_before(*hopeless);
    return;
  }
  keyframe_request_t request{};
  request.ids = inbox_.ids_to_request(expected, std::chrono::steady_clock::now());
  if (request.ids.empty()) return;
  request.utime = newest_utime_;
  request.sequence = request_sequence_++;
  request.session = graph_.session();
  request.sender = "graph_backend";
  request.num_ids = static_cast<std::int32_t>(request.ids.size());
  link_.publish(channels::kKeyframeRequest, request);
}

void BackendNode::give_up_before(std::int32_t id) {
  const std::int32_t expected = graph_.smoother().expected_id();
  std::cerr << std::format("graph_backend: keyframes {} to {} are given up: nobody sends them again", expected, id - 1)
            << std::endl;
  keyframes_given_up_ += std::int64_t{id} - expected;
  graph_.accept_gap_before(id);
  add_waiting_keyframes();
}

void BackendNode::publish_health() {
  keyframe_counts_->queue_drops = assembler_.incomplete() + inbox_.dropped() + keyframes_given_up_;
  const auto now = std::chrono::steady_clock::now();
  BackendSituation situation;
  situation.graph = graph_.smoother().stats();
  situation.refusal = refusal_;
  situation.journal_failure = graph_.failure();
  if (!inbox_.empty()) situation.waiting_for = graph_.smoother().expected_id();
  situation.keyframes_given_up = keyframes_given_up_;
  situation.gave_up_lately = keyframe_losses_.look(keyframes_given_up_, now);
  situation.missed_a_cloud_lately = cloud_losses_.look(situation.graph.clouds_unreadable, now);
  const BackendHealth health = health_of(situation);
  link_.report_health(newest_utime_, health.state, health.text);
}

}  // namespace ignis
