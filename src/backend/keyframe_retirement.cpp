// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframe_retirement.h"

#include <gtsam/inference/Symbol.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "backend/odometry_chain.h"
#include "backend/revision_report.h"

namespace ignis {
namespace {

using gtsam::symbol_shorthand::B;
using gtsam::symbol_shorthand::V;
using gtsam::symbol_shorthand::X;

constexpr std::size_t kShareThatRetires = 8;

/// A loop ends at an earlier keyframe than it begins at.
bool has_retired(const GraphLoop& loop, const SmootherState& state) {
  return state.place_of(std::max(loop.result.from_id, loop.result.to_id)) < state.retired.count;
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
  if (state.nodes.size() - state.retired.count <= most) return {};
  const std::size_t until = state.retired.count + std::max<std::size_t>(1, most / kShareThatRetires);
  const KeyframePose anchor = state.poses[until - 1];
  const std::optional<Eigen::MatrixXd> covariance = solver.marginal_covariance(X(anchor.id));
  if (!covariance) return {};
  std::vector<std::uint64_t> keys;
  for (std::size_t i = state.retired.count; i < until; ++i) {
    const std::int32_t id = state.nodes[i].end.id;
    keys.insert(keys.end(), {X(id), V(id), B(id)});
  }
  if (!solver.fix(keys)) return {};
  const Matrix6d to_map = adjoint(anchor.T_map_body);
  state.retired.covariance += to_map * *covariance * to_map.transpose();
  state.links.erase(state.links.begin(),
                    state.links.begin() + static_cast<std::ptrdiff_t>(until - state.retired.count));
  state.retired.count = until;
  LoopEvents events;
  retire_loops(state, events);
  forget_waiting_loops(state, events);
  refresh_poses(solver, state);
  return events;
}

Matrix6d since_start(const Matrix6d& covariance, const SmootherState& state) {
  const Matrix6d to_body = adjoint(state.poses.back().T_map_body.inverse());
  return covariance + to_body * state.retired.covariance * to_body.transpose();
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
