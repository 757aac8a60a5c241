// SPDX-License-Identifier: Apache-2.0
#include "messages/graph_messages.h"

#include <algorithm>

#include "messages/field_copy.h"
#include "messages/odometry_messages.h"

namespace ignis::messages {
namespace {

// 60 bytes a pose: a part stays below 55 kB.
constexpr std::int64_t kMaxPosesPerPart = 900;

void append_pose(const KeyframePose& pose, smoothed_keyframes_t& message) {
  const Eigen::Vector3d& p = pose.T_map_body.translation;
  const Eigen::Quaterniond& q = pose.T_map_body.rotation;
  ++message.num_keyframes;
  message.ids.push_back(pose.id);
  message.px.push_back(p.x());
  message.py.push_back(p.y());
  message.pz.push_back(p.z());
  message.qw.push_back(q.w());
  message.qx.push_back(q.x());
  message.qy.push_back(q.y());
  message.qz.push_back(q.z());
}

}  // namespace

state_t smoothed_state(NavState state, std::int32_t session, const Pose& T_map_odom) {
  state.T_odom_body = T_map_odom * state.T_odom_body;
  state.v_odom = T_map_odom.rotation * state.v_odom;
  return to_message(state, session, "map");
}

std::vector<smoothed_keyframes_t> to_messages(const GraphRevision& revision) {
  smoothed_keyframes_t plain{};
  plain.utime = revision.utime;
  plain.session = revision.session;
  plain.revision = revision.revision;
  plain.full = revision.full ? 1 : 0;
  plain.graph_keyframes = revision.keyframes;
  plain.newest_id = revision.newest_id;
  store(revision.T_map_odom.translation, plain.map_odom_position);
  store(revision.T_map_odom.rotation, plain.map_odom_quaternion);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      plain.map_odom_covariance[6 * row + column] = revision.covariance(row, column);
    }
  }
  const std::int64_t total = std::ssize(revision.poses);
  const std::int64_t part_count = std::max<std::int64_t>(1, (total + kMaxPosesPerPart - 1) / kMaxPosesPerPart);
  std::vector<smoothed_keyframes_t> parts(static_cast<std::size_t>(part_count), plain);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    parts[i].part = static_cast<std::int16_t>(i);
    parts[i].part_count = static_cast<std::int16_t>(part_count);
  }
  for (std::size_t i = 0; i < revision.poses.size(); ++i) append_pose(revision.poses[i], parts[i / kMaxPosesPerPart]);
  return parts;
}

std::optional<GraphRevision> RevisionAssembler::add(const smoothed_keyframes_t& part) {
  const std::optional<std::vector<smoothed_keyframes_t>> parts = parts_.add(part);
  if (!parts) return std::nullopt;
  const smoothed_keyframes_t& first = parts->front();
  GraphRevision revision;
  revision.utime = first.utime;
  revision.session = first.session;
  revision.revision = first.revision;
  revision.full = first.full != 0;
  revision.keyframes = first.graph_keyframes;
  revision.newest_id = first.newest_id;
  revision.T_map_odom = {load(first.map_odom_quaternion), load(first.map_odom_position)};
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      revision.covariance(row, column) = first.map_odom_covariance[6 * row + column];
    }
  }
  for (const smoothed_keyframes_t& each : *parts) {
    for (std::size_t i = 0; i < each.ids.size(); ++i) {
      revision.poses.push_back(
          {each.ids[i], {{each.qw[i], each.qx[i], each.qy[i], each.qz[i]}, {each.px[i], each.py[i], each.pz[i]}}});
    }
  }
  return revision;
}

loop_result_t to_message(const LoopResult& result, std::int32_t session) {
  loop_result_t message{};
  message.utime = result.utime;
  message.session = session;
  message.keyframes = result.keyframes;
  message.candidates = result.candidates;
  message.passed = result.passed;
  message.accepted = result.accepted() ? 1 : 0;
  message.reason = static_cast<std::int8_t>(result.reason);
  message.stage = static_cast<std::int8_t>(result.stage);
  message.reason_text = result.reason_text.empty() ? text(result.reason) : result.reason_text;
  message.from_id = result.from_id;
  message.to_id = result.to_id;
  message.correction_m = result.correction_m;
  message.correction_rad = result.correction_rad;
  message.mean_residual = result.mean_residual;
  message.matched_fraction = result.matched_fraction;
  message.overlap = result.overlap;
  message.chi_square = result.chi_square;
  message.chi_square_bound = result.chi_square_bound;
  store(result.T_to_from.translation, message.relative_position);
  store(result.T_to_from.rotation, message.relative_quaternion);
  return message;
}

}  // namespace ignis::messages
