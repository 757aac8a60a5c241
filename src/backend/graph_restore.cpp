// SPDX-License-Identifier: Apache-2.0
#include "backend/graph_restore.h"

#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <set>

#include "backend/keyframe_factors.h"
#include "backend/relative_pose_factor.h"
#include "backend/revision_report.h"

namespace ignis {

using gtsam::symbol_shorthand::X;

std::vector<LinearisationPoint> take_linearised(IncrementalSolver& solver) {
  std::set<std::int32_t> ids;  // of whichever of a keyframe's variables
  for (const gtsam::Key key : solver.take_relinearised()) {
    ids.insert(static_cast<std::int32_t>(gtsam::Symbol(key).index()));
  }
  const gtsam::Values& estimated = solver.linearisation_points();
  const gtsam::Values& fixed = solver.fixed();
  std::vector<LinearisationPoint> points;
  for (const std::int32_t id : ids) points.push_back({id, estimate_of(fixed.exists(X(id)) ? fixed : estimated, id)});
  return points;
}

std::string restore_solver(RestoredGraph& graph, const BackendConfig& config, IncrementalSolver& solver) {
  SmootherState& state = graph.state;
  if (state.nodes.empty()) return {};
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  gtsam::Values fixed;
  for (const KeyframeLink& link : state.links) add_link_factors(link, config, factors);
  for (const GraphLoop& loop : state.loops) {
    factors.push_back(
        make_relative_pose_factor(X(loop.result.to_id), X(loop.result.from_id), loop.result.T_to_from, loop.rows));
  }
  for (std::size_t i = 0; i < graph.linearised.size(); ++i) {
    const LinearisationPoint& point = graph.linearised[i];
    insert_estimate(point.id, point.state, i < state.retired.count ? fixed : values);
  }
  solver.add_fixed(fixed);
  const SolverOutcome outcome = solver.add(factors, values);
  if (!outcome.accepted) return outcome.reason;
  static_cast<void>(solver.take_relinearised());  // the journal has them
  const std::size_t first_loop = outcome.factors.size() - state.loops.size();
  for (std::size_t i = 0; i < state.loops.size(); ++i) state.loops[i].factor = outcome.factors[first_loop + i];
  for (std::size_t i = 0; i < state.retired.count; ++i)
    state.poses.push_back({state.nodes[i].end.id, graph.linearised[i].state.T_odom_body});
  refresh_poses(solver, state);
  return {};
}

}  // namespace ignis
