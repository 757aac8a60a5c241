// SPDX-License-Identifier: Apache-2.0
#include "backend/journal/graph_restore.h"

#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <set>

#include "backend/factors/keyframe_factors.h"
#include "backend/factors/relative_pose_factor.h"
#include "backend/keyframes/keyframe_retirement.h"
#include "backend/keyframes/revision_report.h"

namespace ignis {

using gtsam::symbol_shorthand::B;
using gtsam::symbol_shorthand::V;
using gtsam::symbol_shorthand::X;

namespace {

/// Of a keyframe that has retired: where it stays. Its velocity and biases nobody asks for any more, unless it is the
/// newest of them, of which they are estimated.
NavState linearised_at(std::int32_t id, const IncrementalSolver& solver) {
  const gtsam::Values& estimated = solver.linearisation_points();
  if (estimated.exists(X(id))) return estimate_of(estimated, id);
  gtsam::Values values;
  insert_estimate(id, {}, values);
  values.update(X(id), solver.fixed().at(X(id)));
  for (const gtsam::Key key : {V(id), B(id)}) {
    if (estimated.exists(key)) values.update(key, estimated.at(key));
  }
  return estimate_of(values, id);
}

/// Sorts what is fixed from what is estimated. `retired`: how many keyframes have.
void insert_point(const LinearisationPoint& point, std::size_t place, std::size_t retired, gtsam::Values& estimated,
                  gtsam::Values& fixed) {
  gtsam::Values all;
  insert_estimate(point.id, point.state, all);
  (place < retired ? fixed : estimated).insert(X(point.id), all.at(X(point.id)));
  if (place + 1 < retired) return;
  for (const gtsam::Key key : {V(point.id), B(point.id)}) estimated.insert(key, all.at(key));
}

}  // namespace

std::vector<LinearisationPoint> take_linearised(IncrementalSolver& solver) {
  std::set<std::int32_t> ids;  // of whichever of a keyframe's variables
  for (const gtsam::Key key : solver.take_relinearised()) {
    ids.insert(static_cast<std::int32_t>(gtsam::Symbol(key).index()));
  }
  std::vector<LinearisationPoint> points;
  for (const std::int32_t id : ids) {
    const bool is_held = solver.linearisation_points().exists(X(id)) || solver.fixed().exists(X(id));
    if (is_held) points.push_back({id, linearised_at(id, solver)});
  }
  return points;
}

std::string restore_solver(RestoredGraph& graph, const BackendConfig& config, IncrementalSolver& solver) {
  SmootherState& state = graph.state;
  if (state.nodes.empty()) return {};
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  gtsam::Values fixed;
  add_retired_motion(state, factors);
  for (const KeyframeLink& link : state.links) add_link_factors(link, config, factors);
  for (const GraphLoop& loop : state.loops) {
    factors.push_back(
        make_relative_pose_factor(X(loop.result.to_id), X(loop.result.from_id), loop.result.T_to_from, loop.rows));
  }
  for (std::size_t i = 0; i < graph.linearised.size(); ++i)
    insert_point(graph.linearised[i], i, state.retired.count(), values, fixed);
  solver.add_fixed(fixed);
  const SolverOutcome outcome = solver.add(factors, values);
  if (!outcome.accepted) return outcome.reason;
  static_cast<void>(solver.take_relinearised());  // the journal has them
  const std::size_t first_loop = outcome.factors.size() - state.loops.size();
  for (std::size_t i = 0; i < state.loops.size(); ++i) state.loops[i].factor = outcome.factors[first_loop + i];
  for (std::size_t i = 0; i < state.retired.count(); ++i)
    state.poses.push_back({state.nodes[i].end.id, graph.linearised[i].state.T_odom_body});
  refresh_poses(solver, state);
  return {};
}

}  // namespace ignis
