// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframes/keyframe_retirement.h"

#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "backend/factors/keyframe_factors.h"
#include "backend/keyframes/keyframe_thinning.h"
#include "backend/keyframes/odometry_chain.h"
#include "backend/keyframes/revision_report.h"

namespace ignis {
namespace {

using gtsam::symbol_shorthand::B;
using gtsam::symbol_shorthand::V;
using gtsam::symbol_shorthand::X;

constexpr std::size_t kShareThatRetires = 8;  // of what may be estimated: one in so many
constexpr std::size_t kTrials = 2;            // as many keyframes as a loop's trials take are estimated in any case
// [m] What has retired is taken for exact, as a known place, and a loop's own sigma is centimetres.
constexpr double kKnownWithin = 0.1;

/// Until which place keyframes are to retire now: none, or as many blocks as it takes. Asked again only after another
/// block, should the answer come to nothing.
std::size_t retires_until(const BackendConfig& config, const SmootherState& state) {
  const std::size_t estimated = state.nodes.size() - state.retired.count();
  const std::size_t most = std::max(static_cast<std::size_t>(config.estimated_keyframes),
                                    kTrials * static_cast<std::size_t>(config.loop_trial_keyframes));
  const std::size_t block = most / kShareThatRetires;
  if (estimated <= most || (estimated - most - 1) % block != 0) return state.retired.count();
  const std::size_t blocks = (estimated - most + block - 1) / block;
  return state.retired.count() + blocks * block;
}

/// A pose that retires is known by `covariance` (body axes) as the origin of its block: in axes of map, about the
/// origin of map. Tilt does not come along, since gravity tells it anew everywhere.
Matrix6d about_origin(const Pose& T_map_body, const Matrix6d& covariance) {
  const Matrix6d turn = adjoint({T_map_body.rotation, Eigen::Vector3d::Zero()});
  Matrix6d level = turn * covariance * turn.transpose();
  for (const int tilt : {0, 2}) {
    level.row(tilt).setZero();
    level.col(tilt).setZero();
  }
  const Matrix6d shift = adjoint({Eigen::Quaterniond::Identity(), T_map_body.translation});
  return shift * level * shift.transpose();
}

/// Of a pose, in its body axes, when what `block` holds moves as one.
Matrix6d carried_to(const Pose& T_map_body, const RetiredBlock& block) {
  const Matrix6d to_body = adjoint(T_map_body.inverse());
  return to_body * block.covariance * to_body.transpose();
}

/// Which blocks the keyframes from place `first` to `last` are tied to: the newest, by the chain, and those where a
/// loop ends that has stood its trial and leaves no direction open.
std::vector<bool> tied_blocks(std::size_t first, std::size_t last, const SmootherState& state) {
  const std::vector<RetiredBlock>& blocks = state.retired.blocks;
  std::vector<bool> is_tied(blocks.size(), false);
  is_tied.back() = true;
  for (const GraphLoop& loop : state.loops) {
    if (loop.result.stage != LoopStage::kKept || loop.rows.rows() < 6) continue;
    const auto [earlier, later] = std::minmax({state.place_of(loop.result.to_id), state.place_of(loop.result.from_id)});
    if (earlier >= state.retired.count() || later < first || later > last) continue;
    const auto block = std::ranges::upper_bound(blocks, earlier, {}, &RetiredBlock::until);
    is_tied[static_cast<std::size_t>(block - blocks.begin())] = true;
  }
  return is_tied;
}

/// How unsure the known places are that the keyframe at `last` hangs on: the surest block to which keyframes from
/// `first` on are tied.
Matrix6d hanging_on(std::size_t first, std::size_t last, const SmootherState& state) {
  Matrix6d surest = Matrix6d::Zero();
  if (state.retired.blocks.empty()) return surest;
  const std::vector<bool> is_tied = tied_blocks(first, last, state);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < is_tied.size(); ++i) {
    if (!is_tied[i]) continue;
    const Matrix6d covariance = carried_to(state.poses[last].T_map_body, state.retired.blocks[i]);
    const double variance = covariance.bottomRightCorner<3, 3>().trace();
    if (variance >= least) continue;
    least = variance;
    surest = covariance;
  }
  return surest;
}

/// All that is estimated of the keyframes before place `until`: poses, then velocities and biases, of which those of
/// the newest come last.
struct Retiring {
  std::vector<gtsam::Key> poses;
  std::vector<gtsam::Key> motions;

  Retiring(std::size_t until, const SmootherState& state) {
    for (std::size_t i = state.retired.count(); i < until; ++i) poses.push_back(X(state.nodes[i].end.id));
    for (std::size_t i = std::max<std::size_t>(state.retired.count(), 1) - 1; i < until; ++i) {
      motions.insert(motions.end(), {V(state.nodes[i].end.id), B(state.nodes[i].end.id)});
    }
  }
  [[nodiscard]] std::vector<gtsam::Key> all() const {
    std::vector<gtsam::Key> keys = poses;
    keys.insert(keys.end(), motions.begin(), motions.end());
    return keys;
  }
  [[nodiscard]] std::span<const gtsam::Key> newest_motion() const { return std::span(motions).last(2); }
  [[nodiscard]] std::span<const gtsam::Key> other_motions() const {
    return std::span(motions).first(motions.size() - 2);
  }
};

Eigen::Vector<double, 9> motion_of(const NavState& state) {
  Eigen::Vector<double, 9> motion;
  motion << state.v_odom, state.accel_bias, state.gyro_bias;
  return motion;
}

/// With both of its keyframes, of which either may be the later one.
bool has_retired(const GraphLoop& loop, const SmootherState& state) {
  return ignis::has_retired(std::max(loop.result.from_id, loop.result.to_id), state);
}

void retire_loops(SmootherState& state, LoopEvents& events) {
  for (GraphLoop& loop : state.loops) {
    if (!has_retired(loop, state)) continue;
    if (loop.result.stage != LoopStage::kKept) {
      loop.result.stage = LoopStage::kKept;
      loop.result.reason = LoopReason::kKept;
      loop.result.reason_text = "kept: both of its keyframes have retired";
      events.push_back(loop);
    }
    state.retired.loops.push_back(loop);
  }
  std::erase_if(state.loops, [&](const GraphLoop& loop) { return has_retired(loop, state); });
}

void forget_waiting_loops(SmootherState& state, LoopEvents& events) {
  for (GraphLoop& loop : state.waiting) {
    if (!has_retired(loop, state)) continue;
    loop.result.stage = LoopStage::kWithdrawn;
    // It left the graph long ago, if it ever was there.
    if (loop.result.reason == LoopReason::kWithdrawn) loop.result.reason = LoopReason::kContradictsLoops;
    loop.result.reason_text = "forgotten: both of its keyframes have retired";
    events.push_back(loop);
  }
  std::erase_if(state.waiting, [&](const GraphLoop& loop) { return has_retired(loop, state); });
}

/// Of the keyframes that had retired before, which are those before place `until`.
void thin_out(std::size_t until, const BackendConfig& config, IncrementalSolver& solver, SmootherState& state) {
  const std::vector<std::size_t> places = places_to_absorb(until, config, state);
  std::vector<gtsam::Key> keys;
  std::vector<KeyframePose> poses;
  for (const std::size_t place : places) {
    keys.push_back(X(state.nodes[place].end.id));
    poses.push_back(state.poses[place]);
  }
  solver.release(keys);
  state.absorbed_loops += absorb(places, poses, state);
}

}  // namespace

LoopEvents retire_oldest(const BackendConfig& config, IncrementalSolver& solver, SmootherState& state) {
  const std::size_t until = retires_until(config, state);
  if (until == state.retired.count()) return {};
  const std::int32_t newest = state.nodes[until - 1].end.id;
  const std::optional<Eigen::MatrixXd> known = solver.marginal_covariance(X(newest));
  if (!known) return {};
  const Matrix6d covariance = *known + hanging_on(state.retired.count(), until - 1, state);
  if (covariance.diagonal().tail<3>().maxCoeff() > kKnownWithin * kKnownWithin) return {};
  const Retiring retiring(until, state);
  const std::optional<SolverSummary> past = solver.summary_of(retiring.all(), retiring.newest_motion());
  if (!past) return {};
  const Motion motion{motion_of(estimate_of(solver, newest)) + past->offset, past->covariance};
  gtsam::NonlinearFactorGraph instead;
  instead.push_back(make_motion_factor(V(newest), B(newest), motion));
  if (!solver.fix(retiring.poses, retiring.other_motions(), instead)) return {};

  RetiredKeyframes& retired = state.retired;
  const std::size_t first = retired.count();
  state.links.erase(state.links.begin(), state.links.begin() + static_cast<std::ptrdiff_t>(until - first));
  retired.blocks.push_back({until, about_origin(state.poses[until - 1].T_map_body, covariance)});
  retired.newest_motion = motion;
  LoopEvents events;
  retire_loops(state, events);
  forget_waiting_loops(state, events);
  refresh_poses(solver, state);
  thin_out(first, config, solver, state);
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
  const bool both = has_retired(std::max(from_id, to_id), state);
  if (both && (is_absorbed(from_id, state) || is_absorbed(to_id, state))) {
    LoopResult result;
    result.utime = state.nodes.back().end.filter.utime;
    result.stage = LoopStage::kKept;
    result.reason = LoopReason::kKept;
    result.from_id = from_id;
    result.to_id = to_id;
    result.reason_text = "if there was one it stays, for both of its keyframes have retired";
    return result;
  }
  const auto found = std::ranges::find_if(state.retired.loops, [&](const GraphLoop& loop) {
    return loop.result.from_id == from_id && loop.result.to_id == to_id;
  });
  if (found == state.retired.loops.end()) return std::nullopt;
  LoopResult result = found->result;
  result.reason_text = "stays, for both of its keyframes have retired";
  return result;
}

}  // namespace ignis
