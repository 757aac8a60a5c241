// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframes/revision_report.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/Values.h>

#include <algorithm>
#include <iterator>

#include "backend/factors/gtsam_conversion.h"
#include "backend/factors/keyframe_factors.h"
#include "backend/keyframes/axis_doubt.h"
#include "backend/keyframes/keyframe_retirement.h"

namespace ignis {
namespace {

using gtsam::symbol_shorthand::X;

constexpr double kMovedPosition = 1e-4;  // [m]
constexpr double kMovedRotation = 1e-5;  // [rad]

bool has_moved(const Pose& a, const Pose& b) {
  if (a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs()) return false;
  const Vector6d d = body_difference(a, b);
  return d.head<3>().norm() > kMovedRotation || d.tail<3>().norm() > kMovedPosition;
}

void list_moved(SmootherState& state, SmootherUpdate& update) {
  for (std::size_t i = 0; i < state.poses.size(); ++i) {
    const bool is_new = i >= state.published.size();
    if (!is_new && !has_moved(state.published[i], state.poses[i].T_map_body)) continue;
    if (is_new) state.published.emplace_back();
    state.published[i] = state.poses[i].T_map_body;
    update.moved.push_back(state.poses[i]);
  }
}

void describe_newest(IncrementalSolver& solver, const SmootherState& state, SmootherUpdate& update) {
  update.revision = state.revision;
  update.expected_id = state.expected_id;
  update.T_map_odom = T_map_odom(state);
  if (state.nodes.empty()) return;
  const LinkEnd& end = state.nodes.back().end;
  update.newest = estimate_of(solver, end.id);
  update.newest.utime = end.filter.utime;
  update.newest.angular_rate = state.angular_rate;
}

void add_covariance(IncrementalSolver& solver, const SmootherState& state, SmootherUpdate& update) {
  if (state.nodes.empty()) return;
  if (const auto covariance = solver.marginal_covariance(X(state.nodes.back().end.id))) {
    update.covariance = with_axis_doubt(since_start(*covariance, state));
    update.covariance_valid = true;
  }
}

}  // namespace

void refresh_poses(IncrementalSolver& solver, SmootherState& state) {
  for (std::size_t i = state.poses.size(); i < state.nodes.size(); ++i) {
    state.poses.push_back({state.nodes[i].end.id, {}});
  }
  for (const gtsam::Key key : solver.take_changed()) {
    const gtsam::Symbol symbol(key);
    if (symbol.chr() != 'x') continue;
    state.poses[state.place_of(static_cast<std::int32_t>(symbol.index()))].T_map_body = from_gtsam(solver.pose(key));
  }
}

Pose T_map_odom(const SmootherState& state) {
  if (state.nodes.empty()) return {};
  return state.poses.back().T_map_body * state.nodes.back().end.filter.T_odom_body.inverse();
}

void report_revision(IncrementalSolver& solver, SmootherState& state, SmootherUpdate& update) {
  describe_newest(solver, state, update);
  if (!update.accepted()) return;
  add_covariance(solver, state, update);
  list_moved(state, update);
}

SmootherUpdate present_revision(IncrementalSolver& solver, const SmootherState& state) {
  SmootherUpdate update;
  update.verdict = KeyframeVerdict::kAccepted;
  describe_newest(solver, state, update);
  add_covariance(solver, state, update);
  return update;
}

std::vector<KeyframePose> all_poses(const SmootherState& state) {
  std::vector<KeyframePose> poses;
  poses.reserve(state.poses.size() + state.absorbed.size());
  std::ranges::merge(state.absorbed, state.poses, std::back_inserter(poses), {}, &KeyframePose::id, &KeyframePose::id);
  return poses;
}

PoseGraph exported_graph(const SmootherState& state) {
  PoseGraph graph;
  graph.vertices = state.poses;
  for (std::size_t i = 1; i < state.nodes.size(); ++i) {
    const WhiteningRows& rows = state.nodes[i].odometry;
    const Pose T_from_to = state.nodes[i - 1].end.filter.T_odom_body.inverse() * state.nodes[i].end.filter.T_odom_body;
    graph.edges.push_back(
        {state.nodes[i - 1].end.id, state.nodes[i].end.id, T_from_to, rows.transpose() * rows, false});
  }
  for (const std::vector<GraphLoop>* loops : {&state.retired.loops, &state.loops}) {
    for (const GraphLoop& loop : *loops) {
      graph.edges.push_back(
          {loop.result.to_id, loop.result.from_id, loop.result.T_to_from, loop.rows.transpose() * loop.rows, true});
    }
  }
  return graph;
}

}  // namespace ignis
