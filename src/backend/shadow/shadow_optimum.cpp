// SPDX-License-Identifier: Apache-2.0
#include "backend/shadow/shadow_optimum.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/navigation/ImuBias.h>
#include <gtsam/nonlinear/LevenbergMarquardtOptimizer.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>
#include <vector>

#include "backend/factors/gtsam_conversion.h"
#include "backend/keyframes/revision_report.h"
#include "backend/shadow/shadow_graph.h"

namespace ignis {

using gtsam::symbol_shorthand::X;

struct ShadowProblem::Graph {
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values estimate;
  std::vector<std::int32_t> ids;  ///< of the keyframes, ascending
  std::int32_t revision = 0;
};

struct ShadowOptimum::Solution {
  gtsam::Values values;
};

namespace {

struct Stopped : std::exception {};

gtsam::LevenbergMarquardtParams parameters(const std::stop_token& stop, const std::function<void()>& got_on) {
  gtsam::LevenbergMarquardtParams params;
  params.iterationHook = [stop, got_on](std::size_t, double, double) {
    if (stop.stop_requested()) throw Stopped();
    if (got_on) got_on();
  };
  params.setRelativeErrorTol(1e-10);
  params.setAbsoluteErrorTol(1e-8);
  params.setMaxIterations(100);
  return params;
}

void measure_gap(const ShadowProblem::Graph& graph, const gtsam::Values& optimum, ShadowOptimum& result) {
  for (const std::int32_t id : graph.ids) {
    const Vector6d gap = body_difference(from_gtsam(graph.estimate.at<gtsam::Pose3>(X(id))),
                                         from_gtsam(optimum.at<gtsam::Pose3>(X(id))));
    result.largest_gap_rad = std::max(result.largest_gap_rad, gap.head<3>().norm());
    result.largest_gap_m = std::max(result.largest_gap_m, gap.tail<3>().norm());
  }
}

/// A variable of a keyframe that has retired, or has been absorbed since.
bool is_of_retired(gtsam::Key key, const SmootherState& state) {
  return has_retired(static_cast<std::int32_t>(gtsam::Symbol(key).index()), state);
}

/// The optimum as a starting point for the graph as it is by now: keyframes that came later keep their motion relative
/// to the newest one that was solved; those that have retired since stay. Nothing when the optimum holds keyframes that
/// this graph does not.
std::optional<gtsam::Values> carried_to_now(const ShadowOptimum::Solution& optimum, IncrementalSolver& solver,
                                            const SmootherState& state) {
  const gtsam::Values& solved = optimum.values;
  const gtsam::Values& now = solver.estimate();
  gtsam::Pose3 T_new_old;
  for (std::size_t i = state.retired.count(); i < state.nodes.size(); ++i) {
    const gtsam::Key key = X(state.nodes[i].end.id);
    if (solved.exists(key)) T_new_old = solved.at<gtsam::Pose3>(key) * now.at<gtsam::Pose3>(key).inverse();
  }
  gtsam::Values values = now;
  std::size_t carried = 0;
  for (const gtsam::Key key : now.keys()) {
    const char letter = gtsam::Symbol(key).chr();
    if (solved.exists(key)) {
      values.update(key, solved.at(key));
      ++carried;
    } else if (letter == 'x') {
      values.update(key, T_new_old * now.at<gtsam::Pose3>(key));
    } else if (letter == 'v') {
      values.update(key, gtsam::Vector3(T_new_old.rotation().matrix() * now.at<gtsam::Vector3>(key)));
    }
  }
  for (const gtsam::Key key : solved.keys()) carried += !now.exists(key) && is_of_retired(key, state) ? 1 : 0;
  if (carried != solved.size()) return std::nullopt;
  return values;
}

}  // namespace

ShadowOptimum solve(const ShadowProblem& problem, const std::stop_token& stop, const std::function<void()>& got_on) {
  ShadowOptimum result;
  if (!problem.graph || problem.graph->ids.empty()) return result;
  const ShadowProblem::Graph& graph = *problem.graph;
  result.revision = graph.revision;
  result.keyframes = static_cast<int>(graph.ids.size());
  try {
    gtsam::LevenbergMarquardtOptimizer optimizer(graph.factors, graph.estimate, parameters(stop, got_on));
    result.half_chi_square_before = optimizer.error();
    auto solution = std::make_shared<ShadowOptimum::Solution>();
    solution->values = optimizer.optimize();
    result.half_chi_square = optimizer.error();
    measure_gap(graph, solution->values, result);
    result.solved = std::isfinite(result.half_chi_square) && std::isfinite(result.largest_gap_m) &&
                    std::isfinite(result.largest_gap_rad) && result.half_chi_square <= result.half_chi_square_before;
    result.solution = std::move(solution);
  } catch (const std::exception&) {
    // A check that fails leaves the graph as it is.
    result.solved = false;
  }
  return result;
}

ShadowProblem shadow_problem(IncrementalSolver& solver, const SmootherState& state) {
  auto graph = std::make_shared<ShadowProblem::Graph>();
  graph->factors = solver.living_factors();
  graph->estimate = solver.estimate();
  for (std::size_t i = state.retired.count(); i < state.nodes.size(); ++i) graph->ids.push_back(state.nodes[i].end.id);
  graph->revision = state.revision;
  return {std::move(graph)};
}

bool take_over(const ShadowOptimum& optimum, const BackendConfig& config, IncrementalSolver& solver,
               SmootherState& state) {
  if (!optimum.solved) return false;
  const std::optional<gtsam::Values> values = carried_to_now(*optimum.solution, solver, state);
  if (!values) return false;
  ++state.stats.shadow_checks;
  state.stats.shadow_gap_m = optimum.largest_gap_m;
  state.stats.shadow_gap_rad = optimum.largest_gap_rad;
  if (optimum.largest_gap_m <= config.shadow_swap_m && optimum.largest_gap_rad <= config.shadow_swap_rad) return false;
  if (!solver.restart_at(*values)) return false;
  ++state.stats.shadow_swaps;
  refresh_poses(solver, state);
  return true;
}

}  // namespace ignis
