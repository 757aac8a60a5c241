// SPDX-License-Identifier: Apache-2.0
#include "backend/graph_change.h"

#include <algorithm>
#include <format>

#include "common/byte_codec.h"
#include "common/measurement_bytes.h"

namespace ignis {

// One function per struct, in the order of its members, for both directions. They stand in the structs' own namespace,
// where the codec's templates look for them.

void transfer(auto& io, FieldsOf<ImuSum> auto& sum) {
  io.number(sum.duration_s);
  io.matrix(sum.gyro_bias);
  io.matrix(sum.accel_bias);
  io.matrix(sum.increment);
  io.matrix(sum.by_accel_bias);
  io.matrix(sum.by_gyro_bias);
  io.matrix(sum.covariance);
}

void transfer(auto& io, FieldsOf<KeyframeLink> auto& link) {
  io.number(link.id);
  io.number(link.previous_id);
  io.number(link.stationary);
  io.number(link.interval_s);
  io.number(link.velocity_sigma);
  transfer(io, link.guess);
  transfer(io, link.T_previous_this);
  io.matrix(link.odometry);
  io.maybe(link.imu);
}

void transfer(auto& io, FieldsOf<LinkEnd> auto& end) {
  io.number(end.id);
  io.number(end.utime);
  transfer(io, end.T_odom_body);
  transfer(io, end.estimate);
}

void transfer(auto& io, FieldsOf<GraphNode> auto& node) {
  transfer(io, node.end);
  io.matrix(node.odometry);
  transfer(io, node.link);
}

void transfer(auto& io, FieldsOf<LoopResult> auto& result) {
  io.number(result.utime);
  io.number(result.keyframes);
  io.number(result.candidates);
  io.number(result.passed);
  io.number(result.stage);
  io.number(result.reason);
  io.text(result.reason_text);
  io.number(result.from_id);
  io.number(result.to_id);
  io.number(result.correction_m);
  io.number(result.correction_rad);
  io.number(result.mean_residual);
  io.number(result.matched_fraction);
  io.number(result.overlap);
  io.number(result.chi_square);
  io.number(result.chi_square_bound);
  transfer(io, result.T_to_from);
}

void transfer(auto& io, FieldsOf<GraphLoop> auto& loop) {
  transfer(io, loop.result);
  io.matrix(loop.rows);
  io.number(loop.number);
  io.number(loop.entered_id);
}

void transfer(auto& io, FieldsOf<LoopVeto> auto& veto) {
  io.number(veto.from_id);
  io.number(veto.to_id);
}

void transfer(auto& io, FieldsOf<LoopLists> auto& lists) {
  io.list(lists.loops);
  io.list(lists.waiting);
  io.list(lists.vetoes);
}

void transfer(auto& io, FieldsOf<SmootherStats> auto& stats) {
  io.number(stats.loops_withdrawn);
  io.number(stats.duplicates);
  io.number(stats.gaps);
  io.number(stats.invalid);
  io.number(stats.without_imu);
  io.number(stats.shadow_checks);
  io.number(stats.shadow_swaps);
  io.number(stats.shadow_gap_m);
  io.number(stats.shadow_gap_rad);
}

/// Without the lists of loops, which change rarely. Poses follow from the solver, and what was published is published
/// anew.
void transfer(auto& io, FieldsOf<SmootherState> auto& state) {
  io.list(state.nodes);
  io.list(state.clouds);
  transfer(io, state.stats);
  io.matrix(state.angular_rate);
  io.number(state.session);
  io.number(state.expected_id);
  io.number(state.last_loop_id);
  io.number(state.next_loop_number);
  io.number(state.revision);
}

void transfer(auto& io, FieldsOf<LinearisationPoint> auto& point) {
  io.number(point.id);
  transfer(io, point.state.T_odom_body);
  io.matrix(point.state.v_odom);
  io.matrix(point.state.gyro_bias);
  io.matrix(point.state.accel_bias);
}

void transfer(auto& io, FieldsOf<GraphChange> auto& change) {
  transfer(io, change.state);
  io.maybe(change.loops);
  io.list(change.linearised);
}

namespace {

template <class Value>
std::vector<std::byte> encoded(const Value& value) {
  std::vector<std::byte> bytes;
  ByteWriter writer(bytes);
  transfer(writer, value);
  return bytes;
}

LoopLists loops_of(const SmootherState& state) { return {state.loops, state.waiting, state.vetoes}; }

bool is_same_place(const NavState& a, const NavState& b) {
  return a.T_odom_body.rotation.coeffs() == b.T_odom_body.rotation.coeffs() &&
         a.T_odom_body.translation == b.T_odom_body.translation && a.v_odom == b.v_odom && a.gyro_bias == b.gyro_bias &&
         a.accel_bias == b.accel_bias;
}

std::size_t index_of(const std::vector<GraphNode>& nodes, std::int32_t id) {
  const auto found = std::ranges::lower_bound(nodes, id, {}, [](const GraphNode& node) { return node.end.id; });
  return found != nodes.end() && found->end.id == id ? static_cast<std::size_t>(found - nodes.begin()) : nodes.size();
}

/// Why the new nodes cannot follow the newest of `state`, or nothing.
std::string chain_problem(const SmootherState& state, const SmootherState& news) {
  if (news.nodes.size() != news.clouds.size()) return "as many clouds as keyframes are missing";
  if (!state.nodes.empty() && news.session != state.session) return "the session changes";
  std::int32_t previous = state.nodes.empty() ? -1 : state.nodes.back().end.id;
  for (const GraphNode& node : news.nodes) {
    const bool is_linked = node.link.previous_id == previous && node.link.id == node.end.id;
    if (!is_linked || node.end.id <= previous) return std::format("keyframe {} is not linked", node.end.id);
    previous = node.end.id;
  }
  return {};
}

/// Why the estimates and loops of `change` do not fit to the nodes, of which `known` are not new, or nothing.
std::string reference_problem(const SmootherState& state, std::size_t known, const GraphChange& change) {
  std::vector<bool> has_estimate(state.nodes.size() - known);
  for (const LinearisationPoint& point : change.linearised) {
    const std::size_t index = index_of(state.nodes, point.id);
    if (index == state.nodes.size()) return std::format("an estimate names the unknown keyframe {}", point.id);
    if (index >= known) has_estimate[index - known] = true;
  }
  if (std::ranges::find(has_estimate, false) != has_estimate.end()) return "a new keyframe has no estimate";
  if (!change.loops) return {};
  for (const std::vector<GraphLoop>* list : {&change.loops->loops, &change.loops->waiting}) {
    for (const GraphLoop& loop : *list) {
      const bool are_known = index_of(state.nodes, loop.result.from_id) < state.nodes.size() &&
                             index_of(state.nodes, loop.result.to_id) < state.nodes.size();
      if (!are_known) return std::format("loop {}-{} names unknown keyframes", loop.result.from_id, loop.result.to_id);
    }
  }
  return {};
}

}  // namespace

std::vector<std::byte> encode_change(const GraphChange& change) { return encoded(change); }

std::optional<GraphChange> decode_change(std::span<const std::byte> bytes) {
  std::optional<GraphChange> change(std::in_place);
  ByteReader reader(bytes);
  transfer(reader, *change);
  if (reader.failed() || !reader.at_end()) change.reset();
  return change;
}

std::string RestoredGraph::apply(GraphChange change) {
  if (std::string problem = chain_problem(state, change.state); !problem.empty()) return problem;
  const std::size_t known = state.nodes.size();
  std::ranges::move(change.state.nodes, std::back_inserter(state.nodes));
  if (std::string problem = reference_problem(state, known, change); !problem.empty()) {
    state.nodes.resize(known);
    return problem;
  }
  std::ranges::move(change.state.clouds, std::back_inserter(state.clouds));
  linearised.resize(state.nodes.size());
  for (LinearisationPoint& point : change.linearised) linearised[index_of(state.nodes, point.id)] = std::move(point);
  change.state.nodes = std::move(state.nodes);
  change.state.clouds = std::move(state.clouds);
  LoopLists lists = change.loops ? std::move(*change.loops) : loops_of(state);
  change.state.loops = std::move(lists.loops);
  change.state.waiting = std::move(lists.waiting);
  change.state.vetoes = std::move(lists.vetoes);
  state = std::move(change.state);
  return {};
}

ChangeTracker::ChangeTracker() : ChangeTracker(RestoredGraph()) {}

ChangeTracker::ChangeTracker(const RestoredGraph& known)
    : linearised_(known.linearised), loops_(encoded(loops_of(known.state))) {}

GraphChange ChangeTracker::next(const SmootherState& state, std::vector<LinearisationPoint> linearised) {
  GraphChange change;
  const auto known = static_cast<std::ptrdiff_t>(linearised_.size());
  change.state.nodes.assign(state.nodes.begin() + known, state.nodes.end());
  change.state.clouds.assign(state.clouds.begin() + known, state.clouds.end());
  change.state.stats = state.stats;
  change.state.angular_rate = state.angular_rate;
  change.state.session = state.session;
  change.state.expected_id = state.expected_id;
  change.state.last_loop_id = state.last_loop_id;
  change.state.next_loop_number = state.next_loop_number;
  change.state.revision = state.revision;
  for (std::size_t i = 0; i < linearised.size(); ++i) {
    if (i >= linearised_.size() || !is_same_place(linearised_[i].state, linearised[i].state)) {
      change.linearised.push_back(linearised[i]);
    }
  }
  linearised_ = std::move(linearised);
  LoopLists lists = loops_of(state);
  std::vector<std::byte> loops = encoded(lists);
  if (loops != loops_) change.loops = std::move(lists);
  loops_ = std::move(loops);
  return change;
}

}  // namespace ignis
