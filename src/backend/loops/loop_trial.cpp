// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_trial.h"

#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <algorithm>

#include "backend/factors/relative_pose_factor.h"
#include "backend/keyframes/revision_report.h"
#include "backend/loops/graph_evidence.h"
#include "backend/loops/loop_consistency.h"

namespace ignis {
namespace {

using gtsam::symbol_shorthand::X;

constexpr int kUpdatesAfterLoop = 2;      // Gauss-Newton steps that follow a large correction
constexpr std::size_t kMostSuspects = 8;  // whose cost is computed; the others' own error is small

struct Suspect {
  std::size_t index;
  double share;  ///< own chi-square over its bound
};

std::vector<Suspect> suspects_of(const ChiSquareBounds& bounds, IncrementalSolver& solver, const SmootherState& state) {
  std::vector<Suspect> suspects;
  for (std::size_t i = 0; i < state.loops.size(); ++i) {
    const GraphLoop& loop = state.loops[i];
    suspects.push_back({i, 2.0 * solver.half_chi_square(loop.factor) / bounds.of(loop.rows.rows())});
  }
  std::ranges::stable_sort(suspects, std::ranges::greater(), &Suspect::share);
  return suspects;
}

}  // namespace

LoopEntry enter_graph(GraphLoop loop, const BackendConfig& config, IncrementalSolver& solver, SmootherState& state) {
  gtsam::NonlinearFactorGraph factors;
  factors.push_back(
      make_relative_pose_factor(X(loop.result.to_id), X(loop.result.from_id), loop.result.T_to_from, loop.rows));
  const double bound = ChiSquareBounds(config.loop_consistency_probability).of(loop.rows.rows());
  // The graph's chi-square cannot rise by more than what the loop would cost if nothing gave way. Where that is little,
  // as among the hundreds of loops of a place that is driven again and again, nobody need add up all factors.
  double rise = 2.0 * solver.half_chi_square(*factors.front());
  const bool may_contradict = !(rise <= bound);
  const double before = may_contradict ? solver.half_chi_square() : 0.0;
  const SolverOutcome outcome = solver.add(factors, {});
  if (!outcome.accepted) return {false, outcome.reason, 0.0};
  loop.factor = outcome.factors.front();
  loop.entered_id = state.nodes.back().end.id;
  loop.result.stage = LoopStage::kOnTrial;
  loop.result.reason = LoopReason::kAccepted;
  if (may_contradict) rise = 2.0 * (solver.half_chi_square() - before);
  // What is linearised elsewhere may look like a contradiction. A small correction settles with the next keyframe.
  if (!(rise <= bound)) {
    solver.settle(kUpdatesAfterLoop);
    rise = 2.0 * (solver.half_chi_square() - before);
  }
  state.loops.push_back(std::move(loop));
  refresh_poses(solver, state);
  return {true, {}, rise};
}

GraphLoop leave_graph(std::size_t index, const std::string& reason_text, IncrementalSolver& solver,
                      SmootherState& state) {
  GraphLoop loop = std::move(state.loops[index]);
  state.loops.erase(state.loops.begin() + static_cast<std::ptrdiff_t>(index));
  static_cast<void>(solver.remove({&loop.factor, 1}));
  solver.settle(kUpdatesAfterLoop);
  refresh_poses(solver, state);
  loop.result.stage = LoopStage::kWithdrawn;
  loop.result.reason = LoopReason::kWithdrawn;
  loop.result.reason_text = reason_text;
  ++state.stats.loops_withdrawn;
  return loop;
}

std::optional<ContradictedLoop> contradicted_loop(double newest_rise, const BackendConfig& config,
                                                  IncrementalSolver& solver, const SmootherState& state) {
  if (state.loops.empty()) return std::nullopt;
  const ChiSquareBounds bounds(config.loop_consistency_probability);
  const auto bound_of = [&](std::size_t i) { return bounds.of(state.loops[i].rows.rows()); };
  std::vector<Suspect> suspects = suspects_of(bounds, solver, state);
  const std::size_t newest = state.loops.size() - 1;
  const bool risen = !(newest_rise <= bound_of(newest));
  if (!risen && suspects.front().share <= 1.0) return std::nullopt;
  if (suspects.size() > kMostSuspects) suspects.resize(kMostSuspects);
  if (risen && std::ranges::find(suspects, newest, &Suspect::index) == suspects.end())
    suspects.push_back({newest, 0.0});

  ContradictedLoop worst{suspects.front().index, suspects.front().share * bound_of(suspects.front().index),
                         bound_of(suspects.front().index)};
  double worst_share = 0.0;
  bool is_told = false;
  for (const Suspect& suspect : suspects) {
    const GraphLoop* alone = &state.loops[suspect.index];
    const std::optional<LoopEvidence> evidence = evidence_of({&alone, 1}, solver, state);
    if (!evidence) continue;
    is_told = true;
    const double cost = evidence->cost(0);
    if (cost / bound_of(suspect.index) <= worst_share) continue;
    worst_share = cost / bound_of(suspect.index);
    worst = {suspect.index, cost, bound_of(suspect.index)};
  }
  // A rise alone may be the settling of what was linearised elsewhere.
  if (is_told && worst_share <= 1.0) return std::nullopt;
  return worst;
}

}  // namespace ignis
