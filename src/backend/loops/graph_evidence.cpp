// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/graph_evidence.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "backend/factors/gtsam_conversion.h"

namespace ignis {

using gtsam::symbol_shorthand::X;

namespace {

// [1/rad^2, 1/m^2] Information that stands for none in the directions that a loop leaves free.
const Matrix6d kNothingKnown = 1e-6 * Matrix6d::Identity();

}  // namespace

ConsistencyRule rule_of(const BackendConfig& config) {
  return {config.loop_drift_scale, ChiSquareBounds(config.loop_consistency_probability)};
}

LoopClaim claim_of(const GraphLoop& loop, const SmootherState& state) {
  return {state.place_of(loop.result.from_id), state.place_of(loop.result.to_id), loop.result.T_to_from,
          covariance_of(loop.rows, kNothingKnown), static_cast<int>(loop.rows.rows())};
}

IncrementalSolver::KeyPair ends_of(const GraphLoop& loop) { return {X(loop.result.to_id), X(loop.result.from_id)}; }

std::optional<LoopEvidence> evidence_of(std::span<const GraphLoop* const> loops, const IncrementalSolver& solver,
                                        const SmootherState& state) {
  if (!solver.failure().empty()) return std::nullopt;
  std::vector<IncrementalSolver::KeyPair> ends;
  std::vector<LoopEvidence::Part> parts;
  Eigen::VectorXd errors(6 * std::ssize(loops));
  Eigen::Index row = 0;
  for (const GraphLoop* loop : loops) {
    const auto& [to, from] = ends.emplace_back(ends_of(*loop));
    // With the very slope and error that the solver has: a loop that the graph leans on takes with it nearly all that
    // is there, and what remains is their difference.
    const gtsam::Pose3 T_to_from = solver.linearisation_point(to).between(solver.linearisation_point(from));
    gtsam::Matrix6 slope;
    const gtsam::Vector6 error = gtsam::Pose3::Logmap(to_gtsam(loop->result.T_to_from).between(T_to_from), slope);
    errors.segment<6>(row) = slope.partialPivLu().solve(error) + solver.relative_offset({to, from});
    parts.push_back({loop->rows * slope, std::ranges::contains(state.loops, loop->number, &GraphLoop::number)});
    row += 6;
  }
  Eigen::MatrixXd covariance = solver.relative_covariance(ends);
  if (covariance.size() == 0) return std::nullopt;
  return LoopEvidence(std::move(parts), std::move(covariance), std::move(errors));
}

double GraphOpinion::largest_error_m() const { return std::sqrt(test.bound) * open_m; }

GraphOpinion opinion_on(const LoopEvidence& evidence, std::size_t i, const ConsistencyRule& rule) {
  return {{evidence.cost(i), rule.bounds.of(evidence.directions(i))},
          largest_position_sigma(evidence.covariance(i), rule)};
}

GraphOpinion opinion_on(const GraphLoop& loop, const ConsistencyRule& rule, const IncrementalSolver& solver,
                        const SmootherState& state) {
  const GraphLoop* alone = &loop;
  const std::optional<LoopEvidence> evidence = evidence_of({&alone, 1}, solver, state);
  if (!evidence) return {{0.0, rule.bounds.of(loop.rows.rows())}, std::numeric_limits<double>::infinity()};
  return opinion_on(*evidence, 0, rule);
}

}  // namespace ignis
