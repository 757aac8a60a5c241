// SPDX-License-Identifier: Apache-2.0
#include "graph_agreement.h"

#include <map>
#include <ranges>
#include <utility>

#include "messages/graph_messages.h"
#include "messages/graph_revision.h"
#include "messages/odometry_messages.h"

namespace ignis {
namespace {

/// A back end that was started late or is busy moves states by corrections of keyframes long ago.
constexpr int kCorrectionsTried = 200;

}  // namespace

bool GraphAgreement::complete() const {
  const auto all_equal = [](const ChannelAgreement& channel) { return channel.equal == channel.recorded; };
  return all_equal(keyframes) && all_equal(revisions) && all_equal(loops) && all_equal(smoothed_states);
}

GraphComparison::GraphComparison(const RecordedResults& recorded)
    : recorded_(recorded),
      keyframes_(recorded.keyframes, keyframe_key),
      revisions_(recorded.revisions, revision_key),
      loops_(recorded.loops, loop_key) {}

GraphComparison::KeyframeKey GraphComparison::keyframe_key(const keyframe_t& part) {
  return {part.session, part.id, part.part};
}

GraphComparison::RevisionKey GraphComparison::revision_key(const smoothed_keyframes_t& part) {
  return {part.session, part.revision, part.full, part.part};
}

std::int32_t GraphComparison::loop_key(const loop_result_t& message) { return message.sequence; }

void GraphComparison::keyframe_sent(const keyframe_t& part) { keyframes_.compare(part); }

void GraphComparison::graph_changed(const Smoother& smoother, const SmootherUpdate& update, std::int32_t session,
                                    Utime utime) {
  messages::GraphRevision revision = messages::revision_of(smoother, update, session, utime);
  for (const smoothed_keyframes_t& part : messages::to_messages(revision)) revisions_.compare(part);
  if (revisions_.holds({session, revision.revision, 1, 0})) {
    messages::list_all(revision, smoother);
    for (const smoothed_keyframes_t& part : messages::to_messages(revision)) revisions_.compare(part);
  }
  if (update.loop) compare_loop(*update.loop, session);
  for (const LoopResult& loop : update.changed) compare_loop(loop, session);
  corrections_.push_back({session, utime, update.T_map_odom});
}

void GraphComparison::compare_loop(const LoopResult& loop, std::int32_t session) {
  loop_result_t message = messages::to_message(loop, session);
  message.sequence = loop_results_++;
  loops_.compare(message);
}

GraphAgreement GraphComparison::agreement(Utime until) const {
  return {keyframes_.agreement(until), revisions_.agreement(until), loops_.agreement(until), state_agreement(until)};
}

ChannelAgreement GraphComparison::state_agreement(Utime until) const {
  std::map<std::pair<std::int32_t, Utime>, std::span<const std::byte>> odometry;
  for (const std::span<const std::byte> data : recorded_.states) {
    state_t state;
    if (messages::decode_checked(data, state)) odometry[{state.session, state.utime}] = data;
  }
  ChannelAgreement agreement;
  for (const std::span<const std::byte> data : recorded_.smoothed_states) {
    state_t smoothed;
    if (!messages::decode_checked(data, smoothed) || smoothed.utime > until) continue;
    const auto moved = odometry.find({smoothed.session, smoothed.utime});
    if (moved != odometry.end()) agreement.add(smoothed.utime, is_moved(data, moved->second));
  }
  return agreement;
}

bool GraphComparison::is_moved(std::span<const std::byte> smoothed, std::span<const std::byte> odometry) const {
  state_t sent;
  state_t state;
  if (!messages::decode_checked(smoothed, sent) || !messages::decode_checked(odometry, state)) return false;
  const NavState before = messages::from_message(state);
  const Pose after = messages::from_message(sent).T_odom_body;
  const auto is_by = [&](const Pose& T_map_odom) {
    if ((T_map_odom * before.T_odom_body).translation != after.translation) return false;  // most: not worth encoding
    return is_as_sent(messages::smoothed_state(before, state.session, T_map_odom), smoothed, sent);
  };
  int tried = 0;
  for (const Correction& correction : corrections_ | std::views::reverse) {
    if (correction.session != state.session || correction.utime > state.utime) continue;
    if (is_by(correction.T_map_odom)) return true;
    if (++tried == kCorrectionsTried) return false;
  }
  return is_by(Pose{});  // before the first revision
}

}  // namespace ignis
