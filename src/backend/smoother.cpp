// SPDX-License-Identifier: Apache-2.0
#include "backend/smoother.h"

#include <algorithm>

#include "backend/factors/information.h"
#include "backend/journal/graph_change.h"
#include "backend/journal/graph_restore.h"
#include "backend/keyframes/keyframe_chain.h"
#include "backend/keyframes/keyframe_retirement.h"
#include "backend/keyframes/revision_report.h"
#include "backend/loops/loop_admission.h"
#include "backend/loops/loop_search.h"
#include "backend/shadow/shadow_graph.h"
#include "backend/smoother_state.h"
#include "backend/solver/incremental_solver.h"
#include "common/config_check.h"

namespace ignis {
namespace {

CloudStore empty_store(const BackendConfig& config, const RecordArchive* archive) {
  return {static_cast<std::size_t>(1e6 * config.cloud_memory_mb), archive};
}

}  // namespace

struct Smoother::Impl {
  Impl(const BackendConfig& backend, const LoopGates& loop_gates, const RecordArchive* archive)
      : config(backend), gates(loop_gates), solver(backend.solver) {
    state.clouds = empty_store(backend, archive);
  }

  void close_loop(SmootherUpdate& update) {
    LoopProposal proposal = search_loop(state, config, gates);
    proposal.result.utime = state.nodes.back().end.filter.utime;
    proposal.result.keyframes = keyframes_in(state);
    update.loop = proposal.result;
    if (!proposal.verified()) return;
    judge_loop(proposal.result, proposal.rows, update);
  }

  /// Lets the verified loop in if it deserves it. `update.loop` tells what became of it.
  void judge_loop(const LoopResult& result, const WhiteningRows& rows, SmootherUpdate& update) {
    const std::int32_t number = state.next_loop_number;
    for (GraphLoop& event : admit_loop(result, rows, config, solver, state)) {
      if (event.number == number) {
        update.loop = std::move(event.result);
      } else {
        update.changed.push_back(std::move(event.result));
      }
    }
  }

  void review(SmootherUpdate& update) { note(review_loops(config, solver, state), update); }

  static void note(LoopEvents events, SmootherUpdate& update) {
    for (GraphLoop& event : events) update.changed.push_back(std::move(event.result));
  }

  BackendConfig config;
  LoopGates gates;
  IncrementalSolver solver;
  SmootherState state;
  ChangeTracker tracker;
  std::size_t changes = 0;  ///< taken so far: the number of the next one's record
};

Smoother::Smoother(const BackendConfig& config, const LoopGates& gates, const RecordArchive* archive) {
  config::require_valid(config, "backend");
  config::require_valid(gates, "frontend");
  impl_ = std::make_unique<Impl>(config, gates, archive);
}

Smoother::~Smoother() = default;
Smoother::Smoother(Smoother&&) noexcept = default;
Smoother& Smoother::operator=(Smoother&&) noexcept = default;

SmootherUpdate Smoother::add_keyframe(const Keyframe& keyframe) {
  const BackendConfig& config = impl_->config;
  IncrementalSolver& solver = impl_->solver;
  SmootherState& state = impl_->state;
  SmootherUpdate update;
  update.verdict = verdict_on(keyframe, state, update.reason);
  if (update.accepted()) {
    const SolverOutcome outcome = append_keyframe(keyframe, config, solver, state, update.reason);
    if (!outcome.accepted) {
      update.verdict = KeyframeVerdict::kSolver;
      update.reason = outcome.reason;
    }
  }
  if (update.accepted()) {
    refresh_poses(solver, state);
    follow_nodes(state, config);
    impl_->close_loop(update);
    impl_->review(update);
    impl_->note(retire_oldest(config, solver, state), update);
    ++state.revision;
  }
  count_verdict(update.verdict, state);
  report_revision(solver, state, update);
  return update;
}

SmootherUpdate Smoother::add_loop(const LoopMeasurement& measurement) {
  const BackendConfig& config = impl_->config;
  IncrementalSolver& solver = impl_->solver;
  SmootherState& state = impl_->state;
  SmootherUpdate update;
  LoopResult result;
  result.from_id = measurement.from_id;
  result.to_id = measurement.to_id;
  result.T_to_from = measurement.T_to_from;
  result.reason = LoopReason::kSolverRefused;
  result.keyframes = keyframes_in(state);
  const GraphNode* from = state.node_of(measurement.from_id);
  const GraphNode* to = state.node_of(measurement.to_id);
  const auto is_known = [&](const GraphNode* node, std::int32_t id) {
    return node != nullptr || is_absorbed(id, state);
  };
  if (!is_known(from, measurement.from_id) || !is_known(to, measurement.to_id) ||
      measurement.from_id == measurement.to_id) {
    result.reason_text = "the loop names keyframes that the graph does not hold";
  } else if (has_retired(std::max(measurement.from_id, measurement.to_id), state)) {
    result.reason_text = "both of the loop's keyframes have retired";
  } else if (from == nullptr || to == nullptr) {
    result.reason_text = "one of the loop's keyframes has retired, and another stands for it";
  } else if (!measurement.T_to_from.all_finite() || !measurement.information.allFinite()) {
    result.reason_text = "the loop is not finite";
  } else if (is_vetoed(state.vetoes, measurement.from_id, measurement.to_id, config.loop_min_spacing)) {
    result.reason = LoopReason::kVetoed;
    result.reason_text = text(result.reason);
  } else {
    result.utime = from->end.filter.utime;
    follow_nodes(state, config);
    impl_->judge_loop(result, whitening(measurement.information), update);
    impl_->review(update);
    ++state.revision;
  }
  update.verdict = KeyframeVerdict::kAccepted;
  if (!update.loop) update.loop = result;
  report_revision(solver, state, update);
  return update;
}

bool Smoother::is_of_another_drive(const Keyframe& keyframe) const {
  return ignis::is_of_another_drive(keyframe, impl_->state);
}

SmootherUpdate Smoother::withdraw_loop(std::int32_t from_id, std::int32_t to_id) {
  IncrementalSolver& solver = impl_->solver;
  SmootherState& state = impl_->state;
  SmootherUpdate update;
  update.verdict = KeyframeVerdict::kAccepted;
  impl_->note(dismiss_loops(from_id, to_id, solver, state), update);
  if (!update.changed.empty()) ++state.revision;
  update.loop = retired_loop(from_id, to_id, state);
  report_revision(solver, state, update);
  return update;
}

SmootherUpdate Smoother::veto_loop(std::int32_t from_id, std::int32_t to_id) {
  const LoopVeto veto{from_id, to_id};
  if (!std::ranges::contains(impl_->state.vetoes, veto)) impl_->state.vetoes.push_back(veto);
  SmootherUpdate update = withdraw_loop(from_id, to_id);
  if (update.loop) update.loop->reason_text = "vetoed from now on, but " + update.loop->reason_text;
  return update;
}

ShadowProblem Smoother::shadow_problem() { return ignis::shadow_problem(impl_->solver, impl_->state); }

SmootherUpdate Smoother::adopt(const ShadowOptimum& optimum) {
  const BackendConfig& config = impl_->config;
  IncrementalSolver& solver = impl_->solver;
  SmootherState& state = impl_->state;
  SmootherUpdate update;
  update.verdict = KeyframeVerdict::kAccepted;
  if (take_over(optimum, config, solver, state)) ++state.revision;
  report_revision(solver, state, update);
  return update;
}

SmootherUpdate Smoother::present() const { return present_revision(impl_->solver, impl_->state); }

void Smoother::accept_gap_before(std::int32_t id) { impl_->state.expected_id = std::max(impl_->state.expected_id, id); }

std::vector<KeyframePose> Smoother::all_poses() const { return ignis::all_poses(impl_->state); }
Pose Smoother::T_map_odom() const { return ignis::T_map_odom(impl_->state); }
std::int32_t Smoother::revision() const { return impl_->state.revision; }
std::int32_t Smoother::expected_id() const { return impl_->state.expected_id; }
PoseGraph Smoother::pose_graph() const { return exported_graph(impl_->state); }

SmootherStats Smoother::stats() const {
  SmootherStats stats = impl_->state.stats;
  stats.keyframes = keyframes_in(impl_->state);
  stats.absorbed = static_cast<int>(impl_->state.absorbed.size());
  stats.retired = stats.absorbed + static_cast<int>(impl_->state.retired.count());
  stats.loops_kept =
      impl_->state.absorbed_loops + static_cast<int>(impl_->state.loops.size() + impl_->state.retired.loops.size());
  stats.loops_on_trial = static_cast<int>(std::ranges::count(impl_->state.loops, LoopStage::kOnTrial,
                                                             [](const GraphLoop& loop) { return loop.result.stage; }));
  stats.loops_waiting = static_cast<int>(impl_->state.waiting.size());
  stats.solver_rebuilds = impl_->solver.rebuilds();
  stats.clouds_forgotten = impl_->state.clouds.forgotten();
  stats.clouds_unreadable = impl_->state.clouds.unreadable();
  stats.solver_failure = impl_->solver.failure();
  return stats;
}

std::vector<std::byte> Smoother::take_change() {
  auto& impl = *impl_;
  const GraphChange change = impl.tracker.next(impl.state, take_linearised(impl.solver));
  impl.state.clouds.note_record(impl.changes++);
  return encode_change(change);
}

SmootherRestoration restore_smoother(const BackendConfig& config, const LoopGates& gates,
                                     std::span<const std::span<const std::byte>> records,
                                     const RecordArchive* archive) {
  SmootherRestoration restoration{Smoother(config, gates, archive), 0, {}};
  RestoredGraph graph(config);
  graph.state.clouds = empty_store(config, archive);
  for (const std::span<const std::byte> record : records) {
    std::optional<GraphChange> change = decode_change(record);
    restoration.problem = change ? graph.apply(std::move(*change)) : "a record is no change of a graph";
    if (!restoration.problem.empty()) break;
    ++restoration.records_used;
  }
  Smoother::Impl& impl = *restoration.smoother.impl_;
  if (std::string refusal = restore_solver(graph, config, impl.solver); !refusal.empty()) {
    return {Smoother(config, gates, archive), 0, std::move(refusal)};
  }
  impl.tracker = ChangeTracker(graph);
  impl.changes = graph.changes;
  impl.state = std::move(graph.state);
  return restoration;
}

}  // namespace ignis
