// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframe_retirement.h"

#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "backend/keyframe_factors.h"
#include "backend/odometry_chain.h"
#include "backend/revision_report.h"

namespace ignis {
namespace {

using gtsam::symbol_shorthand::B;
using gtsam::symbol_shorthand::V;
using gtsam::symbol_shorthand::X;

constexpr std::size_t kShareThatRetires = 8;

/// All that is estimated of the keyframes before place `until`.
std::vector<gtsam::Key> variables_until(std::size_t until, const SmootherState& state) {
  std::vector<gtsam::Key> keys;
  if (state.retired.count() > 0) {
    const std::int32_t id = state.nodes[state.retired.count() - 1].end.id;
    keys = {V(id), B(id)};
  }
  for (std::size_t i = state.retired.count(); i < until; ++i) {
    const std::int32_t id = state.nodes[i].end.id;
    keys.insert(keys.end(), {X(id), V(id), B(id)});
  }
  return keys;
}

/// Of a pose, in its body axes, when what `block` holds moves as one. Tilt does not come along, since gravity tells it
/// anew.
Matrix6d carried_to(const Pose& T_map_body, const RetiredBlock& block) {
  Matrix6d covariance = block.covariance;
  for (const int tilt : {0, 2}) {
    covariance.row(tilt).setZero();
    covariance.col(tilt).setZero();
  }
  const Matrix6d to_body = adjoint(T_map_body.inverse());
  return to_body * covariance * to_body.transpose();
}

/// How unsure the known places are that the keyframe at `place` hangs on: those of the surest block that the chain
/// behind it or a loop from `first` to `place` is tied to.
Matrix6d hanging_on(std::size_t first, std::size_t place, const SmootherState& state) {
  const std::vector<RetiredBlock>& blocks = state.retired.blocks;
  if (blocks.empty()) return Matrix6d::Zero();
  std::vector<bool> is_tied(blocks.size(), false);
  is_tied.back() = true;
  for (const GraphLoop& loop : state.loops) {
    const auto [earlier, later] = std::minmax({state.place_of(loop.result.to_id), state.place_of(loop.result.from_id)});
    if (earlier >= state.retired.count() || later < first || later > place) continue;
    const auto block = std::ranges::upper_bound(blocks, earlier, {}, &RetiredBlock::until);
    is_tied[static_cast<std::size_t>(block - blocks.begin())] = true;
  }
  Matrix6d surest = Matrix6d::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!is_tied[i]) continue;
    const Matrix6d covariance = carried_to(state.poses[place].T_map_body, blocks[i]);
    const double variance = covariance.bottomRightCorner<3, 3>().trace();
    if (variance >= least) continue;
    least = variance;
    surest = covariance;
  }
  return surest;
}

Eigen::Vector<double, 9> motion_of(const NavState& state) {
  Eigen::Vector<double, 9> motion;
  motion << state.v_odom, state.accel_bias, state.gyro_bias;
  return motion;
}

/// A loop ends at an earlier keyframe than it begins at.
bool has_retired(const GraphLoop& loop, const SmootherState& state) {
  return state.place_of(std::max(loop.result.from_id, loop.result.to_id)) < state.retired.count();
}

void retire_loops(SmootherState& state, LoopEvents& events) {
  for (GraphLoop& loop : state.loops) {
    if (!has_retired(loop, state)) continue;
    state.retired.loops.push_back(
        {loop.result.to_id, loop.result.from_id, loop.result.T_to_from, loop.rows.transpose() * loop.rows, true});
    if (loop.result.stage == LoopStage::kKept) continue;
    loop.result.stage = LoopStage::kKept;
    loop.result.reason = LoopReason::kKept;
    loop.result.reason_text = "kept: both of its keyframes have retired";
    events.push_back(loop);
  }
  std::erase_if(state.loops, [&](const GraphLoop& loop) { return has_retired(loop, state); });
}

void forget_waiting_loops(SmootherState& state, LoopEvents& events) {
  for (GraphLoop& loop : state.waiting) {
    if (!has_retired(loop, state)) continue;
    loop.result.stage = LoopStage::kWithdrawn;
    loop.result.reason_text = "forgotten: both of its keyframes have retired";
    events.push_back(loop);
  }
  std::erase_if(state.waiting, [&](const GraphLoop& loop) { return has_retired(loop, state); });
}

}  // namespace

LoopEvents retire_oldest(const BackendConfig& config, IncrementalSolver& solver, SmootherState& state) {
  const auto most = static_cast<std::size_t>(config.estimated_keyframes);
  if (state.nodes.size() - state.retired.count() <= most) return {};
  const std::size_t until = state.retired.count() + most / kShareThatRetires;
  const std::int32_t newest = state.nodes[until - 1].end.id;
  const std::vector<gtsam::Key> retiring = variables_until(until, state);
  const std::optional<Eigen::MatrixXd> past =
      solver.covariance_among(retiring, std::array<gtsam::Key, 2>{V(newest), B(newest)});
  const std::optional<Eigen::MatrixXd> present = solver.marginal_covariance(X(newest));
  if (!past || !present) return {};
  const Motion motion{motion_of(estimate_of(solver, newest)), *past};
  std::vector<gtsam::Key> known;
  std::ranges::copy_if(retiring, std::back_inserter(known),
                       [&](gtsam::Key key) { return key != V(newest) && key != B(newest); });
  gtsam::NonlinearFactorGraph instead;
  instead.push_back(make_motion_factor(V(newest), B(newest), motion));
  if (!solver.fix(known, instead)) return {};

  RetiredKeyframes& retired = state.retired;
  state.links.erase(state.links.begin(), state.links.begin() + static_cast<std::ptrdiff_t>(until - retired.count()));
  const Matrix6d to_map = adjoint(state.poses[until - 1].T_map_body);
  const Matrix6d covariance = *present + hanging_on(retired.count(), until - 1, state);
  retired.blocks.push_back({until, to_map * covariance * to_map.transpose()});
  retired.newest_motion = motion;
  LoopEvents events;
  retire_loops(state, events);
  forget_waiting_loops(state, events);
  refresh_poses(solver, state);
  return events;
}

void add_retired_motion(const SmootherState& state, gtsam::NonlinearFactorGraph& factors) {
  if (state.retired.count() == 0) return;
  const std::int32_t newest = state.nodes[state.retired.count() - 1].end.id;
  factors.push_back(make_motion_factor(V(newest), B(newest), state.retired.newest_motion));
}

Matrix6d since_start(const Matrix6d& covariance, const SmootherState& state) {
  return covariance + hanging_on(state.retired.count(), state.nodes.size() - 1, state);
}

std::optional<LoopResult> retired_loop(std::int32_t from_id, std::int32_t to_id, const SmootherState& state) {
  const auto is_meant = [&](const PoseGraphEdge& edge) { return edge.from == to_id && edge.to == from_id; };
  const auto found = std::ranges::find_if(state.retired.loops, is_meant);
  if (found == state.retired.loops.end()) return std::nullopt;
  LoopResult result;
  result.keyframes = static_cast<int>(state.nodes.size());
  result.stage = LoopStage::kKept;
  result.reason = LoopReason::kKept;
  result.reason_text = "stays: both of its keyframes have retired";
  result.from_id = from_id;
  result.to_id = to_id;
  result.T_to_from = found->T_from_to;
  return result;
}

}  // namespace ignis
