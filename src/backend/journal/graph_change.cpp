// SPDX-License-Identifier: Apache-2.0
#include "backend/journal/graph_change.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <format>
#include <functional>
#include <iterator>
#include <utility>

#include "backend/keyframes/erase_places.h"
#include "backend/keyframes/keyframe_thinning.h"
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
  io.maybe(link.sighted);
  io.maybe(link.imu);
}

void transfer(auto& io, FieldsOf<LinkEnd> auto& end) {
  io.number(end.id);
  transfer(io, end.filter);
  transfer(io, end.estimate);
}

void transfer(auto& io, FieldsOf<GraphNode> auto& node) {
  transfer(io, node.end);
  io.matrix(node.odometry);
  io.matrix(node.pose_covariance);
}

void transfer(auto& io, FieldsOf<RetiredBlock> auto& block) {
  io.number(block.until);
  io.matrix(block.covariance);
}

void transfer(auto& io, FieldsOf<RetiredKeyframes> auto& retired) {
  io.list(retired.blocks);
  io.matrix(retired.newest_motion.mean);
  io.matrix(retired.newest_motion.covariance);
  io.list(retired.loops);
}

void transfer(auto& io, FieldsOf<LoopVeto> auto& veto) {
  io.number(veto.from_id);
  io.number(veto.to_id);
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

/// Without loops and clouds. Poses follow from the solver, and what was published is published anew.
void transfer(auto& io, FieldsOf<SmootherState> auto& state) {
  io.list(state.nodes);
  io.list(state.links);
  io.list(state.vetoes);
  transfer(io, state.stats);
  io.matrix(state.angular_rate);
  io.number(state.session);
  io.number(state.expected_id);
  io.number(state.last_loop_id);
  io.number(state.next_loop_number);
  io.number(state.revision);
  io.number(state.absorbed_loops);
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
  io.maybe(change.retired);
  io.list(change.absorbed);
  io.list(change.clouds);
  transfer(io, change.loops);
  transfer(io, change.waiting);
  io.list(change.linearised);
}

namespace {

void copy_scalars(const SmootherState& from, SmootherState& to) {
  to.stats = from.stats;
  to.angular_rate = from.angular_rate;
  to.session = from.session;
  to.expected_id = from.expected_id;
  to.last_loop_id = from.last_loop_id;
  to.next_loop_number = from.next_loop_number;
  to.revision = from.revision;
  to.absorbed_loops = from.absorbed_loops;
}

std::vector<std::int32_t> ids_of(const std::vector<KeyframePose>& poses) {
  std::vector<std::int32_t> ids;
  ids.reserve(poses.size());
  for (const KeyframePose& pose : poses) ids.push_back(pose.id);
  return ids;
}

std::size_t index_of(const std::vector<GraphNode>& nodes, std::int32_t id) {
  const auto found = std::ranges::lower_bound(nodes, id, {}, [](const GraphNode& node) { return node.end.id; });
  return found != nodes.end() && found->end.id == id ? static_cast<std::size_t>(found - nodes.begin()) : nodes.size();
}

/// Why the new nodes cannot follow the newest of `state`, or nothing.
std::string chain_problem(const SmootherState& state, const GraphChange& change) {
  const SmootherState& news = change.state;
  if (news.nodes.size() != change.clouds.size()) return "as many clouds as keyframes are missing";
  if (!state.nodes.empty() && news.session != state.session) return "the session changes";
  std::int32_t previous = state.nodes.empty() ? -1 : state.nodes.back().end.id;
  const std::size_t nodes = state.nodes.size() + news.nodes.size();
  const std::size_t retired = change.retired ? change.retired->count() : state.retired.count();
  if (change.retired && (retired <= state.retired.count() || retired >= nodes))
    return std::format("{} of {} keyframes have retired, after {}", retired, nodes, state.retired.count());
  // Those that came and retired within one change have no links any more.
  if (news.links.size() != std::min(news.nodes.size(), nodes - retired)) return "links of keyframes are missing";
  const std::size_t first_linked = news.nodes.size() - news.links.size();
  for (std::size_t i = 0; i < news.nodes.size(); ++i) {
    const std::int32_t id = news.nodes[i].end.id;
    const KeyframeLink* link = i < first_linked ? nullptr : &news.links[i - first_linked];
    const bool is_linked = link == nullptr || (link->previous_id == previous && link->id == id);
    if (!is_linked || id <= previous) return std::format("keyframe {} is not linked", id);
    previous = id;
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
  for (const std::vector<GraphLoop>* list :
       {&change.loops.altered, &change.loops.appended, &change.waiting.altered, &change.waiting.appended}) {
    for (const GraphLoop& loop : *list) {
      const bool are_known = index_of(state.nodes, loop.result.from_id) < state.nodes.size() &&
                             index_of(state.nodes, loop.result.to_id) < state.nodes.size();
      if (!are_known) return std::format("loop {}-{} names unknown keyframes", loop.result.from_id, loop.result.to_id);
    }
  }
  return {};
}

/// Why what has retired cannot be so, or nothing; the new nodes are among `state`'s. A loop between two keyframes that
/// have retired is in neither list of loops.
std::string retirement_problem(const SmootherState& state, const GraphChange& change) {
  const std::size_t retired = change.retired ? change.retired->count() : state.retired.count();
  const auto has_retired = [&](const GraphLoop& loop) {
    return index_of(state.nodes, std::max(loop.result.from_id, loop.result.to_id)) < retired;
  };
  for (const auto& [list, change_of_list] :
       {std::pair(&state.loops, &change.loops), std::pair(&state.waiting, &change.waiting)}) {
    const auto stays = [&](const GraphLoop& loop) {
      return has_retired(loop) && !std::ranges::contains(change_of_list->removed, loop.number);
    };
    if (std::ranges::any_of(*list, stays) || std::ranges::any_of(change_of_list->altered, has_retired) ||
        std::ranges::any_of(change_of_list->appended, has_retired))
      return "a loop between keyframes that have retired";
  }
  if (!change.retired) return {};
  std::size_t until = state.retired.count();
  for (const RetiredBlock& block : change.retired->blocks) {
    if (block.until <= until || !block.covariance.allFinite()) return "a block of keyframes that have retired is none";
    until = block.until;
  }
  if (!std::ranges::all_of(change.retired->loops, has_retired)) return "a loop has retired before its keyframes";
  const Eigen::LLT<Eigen::Matrix<double, 9, 9>> root(change.retired->newest_motion.covariance);
  const bool is_known = change.retired->newest_motion.mean.allFinite() &&
                        change.retired->newest_motion.covariance.allFinite() && root.info() == Eigen::Success;
  return is_known ? "" : "the motion of the newest keyframe that has retired is not known";
}

/// Why these keyframes cannot have been absorbed, or nothing; the new nodes are among `state`'s.
std::string absorption_problem(const SmootherState& state, const GraphChange& change) {
  const std::size_t retired = change.retired ? change.retired->count() : state.retired.count();
  const auto is_absorbed = [&](std::int32_t id) { return std::ranges::binary_search(change.absorbed, id); };
  if (std::ranges::adjacent_find(change.absorbed, std::greater_equal()) != change.absorbed.end())
    return "keyframes that were absorbed are not in order";
  const std::int64_t loops = std::ssize(state.retired.loops) + std::ssize(state.loops);
  const std::int64_t went = std::int64_t{change.state.absorbed_loops} - state.absorbed_loops;
  if (went < 0 || went > loops) return "more loops went with keyframes than there were";
  for (const std::int32_t id : change.absorbed) {
    if (index_of(state.nodes, id) + 1 >= retired) return std::format("keyframe {} was absorbed before its time", id);
  }
  for (const auto& [list, change_of_list] :
       {std::pair(&state.loops, &change.loops), std::pair(&state.waiting, &change.waiting)}) {
    const auto ends_there = [&](const GraphLoop& loop) {
      return is_absorbed(loop.result.from_id) || is_absorbed(loop.result.to_id);
    };
    const auto stays = [&](const GraphLoop& loop) {
      return ends_there(loop) && !std::ranges::contains(change_of_list->removed, loop.number);
    };
    if (std::ranges::any_of(*list, stays) || std::ranges::any_of(change_of_list->altered, ends_there) ||
        std::ranges::any_of(change_of_list->appended, ends_there))
      return "a loop ends at a keyframe that was absorbed";
  }
  return {};
}

}  // namespace

std::vector<std::byte> encode_change(const GraphChange& change) { return to_bytes(change); }

std::optional<GraphChange> decode_change(std::span<const std::byte> bytes) { return from_bytes<GraphChange>(bytes); }

std::string RestoredGraph::apply(GraphChange change) {
  if (std::string unlinked = chain_problem(state, change); !unlinked.empty()) return unlinked;
  if (!fits(change.loops, state.loops) || !fits(change.waiting, state.waiting)) return "a loop that changes is missing";
  const std::size_t known = state.nodes.size();
  std::ranges::move(change.state.nodes, std::back_inserter(state.nodes));
  std::string problem = reference_problem(state, known, change);
  if (problem.empty()) problem = retirement_problem(state, change);
  if (problem.empty()) problem = absorption_problem(state, change);
  if (!problem.empty()) {
    state.nodes.resize(known);
    return problem;
  }
  for (std::size_t i = known; i < state.nodes.size(); ++i) {
    state.clouds.add(state.nodes[i].end.id, std::move(change.clouds[i - known]));
  }
  state.clouds.note_record(changes++);
  linearised.resize(state.nodes.size());
  for (LinearisationPoint& point : change.linearised) linearised[index_of(state.nodes, point.id)] = std::move(point);
  apply_to(state.loops, std::move(change.loops));
  apply_to(state.waiting, std::move(change.waiting));
  std::ranges::move(change.state.vetoes, std::back_inserter(state.vetoes));
  if (change.retired) {
    std::ranges::move(change.retired->loops, std::back_inserter(state.retired.loops));
    std::ranges::move(change.retired->blocks, std::back_inserter(state.retired.blocks));
    state.retired.newest_motion = change.retired->newest_motion;
  }
  std::ranges::move(change.state.links, std::back_inserter(state.links));
  while (state.links.size() > state.nodes.size() - state.retired.count()) state.links.pop_front();
  follow_nodes(state, config);
  let_go(change.absorbed);
  copy_scalars(change.state, state);
  return {};
}

void RestoredGraph::let_go(std::span<const std::int32_t> absorbed) {
  std::vector<std::size_t> places;
  std::vector<KeyframePose> poses;
  for (const std::int32_t id : absorbed) {
    places.push_back(index_of(state.nodes, id));
    poses.push_back({id, linearised[places.back()].state.T_odom_body});
  }
  absorb(places, poses, state);
  erase_places(linearised, places);
}

ChangeTracker::ChangeTracker() : ChangeTracker(RestoredGraph(BackendConfig())) {}

ChangeTracker::ChangeTracker(const RestoredGraph& known)
    : nodes_(known.state.nodes.size()),
      retired_(known.state.retired.count()),
      absorbed_(ids_of(known.state.absorbed)),
      vetoes_(known.state.vetoes.size()) {
  static_cast<void>(loops_.next(known.state.loops));
  static_cast<void>(waiting_.next(known.state.waiting));
}

/// What has retired beyond the first `retired_`, as it was before the newest `absorbed` were absorbed.
RetiredKeyframes ChangeTracker::newly_retired(const SmootherState& state, std::size_t absorbed) const {
  RetiredKeyframes news;
  news.newest_motion = state.retired.newest_motion;
  for (const RetiredBlock& block : state.retired.blocks) {
    if (block.until > retired_) news.blocks.push_back({block.until + absorbed, block.covariance});
  }
  for (const GraphLoop& loop : state.retired.loops) {
    const bool is_new = state.place_of(std::max(loop.result.from_id, loop.result.to_id)) >= retired_;
    if (is_new) news.loops.push_back(loop);
  }
  return news;
}

GraphChange ChangeTracker::next(const SmootherState& state, std::vector<LinearisationPoint> linearised) {
  GraphChange change;
  std::vector<std::int32_t> absorbed = ids_of(state.absorbed);
  std::ranges::set_difference(absorbed, absorbed_, std::back_inserter(change.absorbed));
  absorbed_ = std::move(absorbed);
  // All of the new ones had retired before.
  nodes_ -= change.absorbed.size();
  retired_ -= change.absorbed.size();
  change.state.nodes.assign(state.nodes.begin() + static_cast<std::ptrdiff_t>(nodes_), state.nodes.end());
  for (std::size_t i = nodes_; i < state.nodes.size(); ++i) {
    const CompactCloud* cloud = state.clouds.in_memory(i);
    change.clouds.push_back(cloud != nullptr ? *cloud : CompactCloud());
  }
  const auto linked = std::min(std::ssize(state.links), std::ssize(state.nodes) - static_cast<std::ptrdiff_t>(nodes_));
  change.state.links.assign(state.links.end() - linked, state.links.end());
  nodes_ = state.nodes.size();
  if (state.retired.count() > retired_) change.retired = newly_retired(state, change.absorbed.size());
  retired_ = state.retired.count();
  change.state.vetoes.assign(state.vetoes.begin() + static_cast<std::ptrdiff_t>(vetoes_), state.vetoes.end());
  vetoes_ = state.vetoes.size();
  copy_scalars(state, change.state);
  change.linearised = std::move(linearised);
  change.loops = loops_.next(state.loops);
  change.waiting = waiting_.next(state.waiting);
  return change;
}

}  // namespace ignis
