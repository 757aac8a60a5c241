// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_admission.h"

#include <algorithm>
#include <cmath>
#include <format>
#include <optional>
#include <utility>

#include "backend/loops/graph_evidence.h"
#include "backend/loops/loop_consistency.h"
#include "backend/loops/loop_exchange.h"
#include "backend/loops/loop_group.h"
#include "backend/loops/loop_hearing.h"
#include "backend/loops/loop_trial.h"

namespace ignis {
namespace {

constexpr std::size_t kMostWaiting = 100;  // the oldest is forgotten

void note(GraphLoop& loop, const ChiSquareTest& test) {
  loop.result.chi_square = test.value;
  loop.result.chi_square_bound = test.bound;
}

/// What has left the graph waits: where it was contradicted, for others to stand with.
void wait_outside(GraphLoop loop, bool is_contradicted, SmootherState& state, LoopEvents& events) {
  events.push_back(loop);
  loop.result.stage = LoopStage::kVerified;
  loop.is_contradicted = is_contradicted;
  state.waiting.push_back(std::move(loop));
}

bool any_withdrawn(const LoopEvents& events) {
  return std::ranges::contains(events, LoopReason::kWithdrawn,
                               [](const GraphLoop& loop) { return loop.result.reason; });
}

/// Where loops have left the graph, those that it had contradicted before may fit now.
void try_again_those_before(const LoopEvents& events, SmootherState& state) {
  if (!any_withdrawn(events)) return;
  for (GraphLoop& waiting : state.waiting) {
    if (!std::ranges::contains(events, waiting.number, &GraphLoop::number)) waiting.is_contradicted = false;
  }
}

/// The graph knows better with every loop: one that it contradicted, by turns, is asked again.
void try_again_one(SmootherState& state) {
  if (state.waiting.empty()) return;
  const auto turn = static_cast<std::size_t>(state.nodes.back().end.id) % state.waiting.size();
  state.waiting[turn].is_contradicted = false;
}

/// Takes out, worst first, every loop that the graph contradicts.
void withdraw_contradicted(double newest_rise, const BackendConfig& config, IncrementalSolver& solver,
                           SmootherState& state, LoopEvents& events) {
  while (const auto worst = contradicted_loop(newest_rise, config, solver, state)) {
    GraphLoop loop =
        leave_graph(worst->index,
                    std::format("withdrawn: without it the chi-square falls by {:.1f}, at most {:.1f} is believed",
                                worst->chi_square, worst->bound),
                    solver, state);
    note(loop, {worst->chi_square, worst->bound});
    wait_outside(std::move(loop), true, state, events);
    // With the culprit gone, what the newest loop had raised says nothing any more; its own error does.
    newest_rise = 0.0;
  }
}

/// Loops in the graph that the larger set contradicts go back among those that wait.
void withdraw_outvoted(const LoopHearing& hearing, IncrementalSolver& solver, SmootherState& state,
                       LoopEvents& events) {
  for (std::size_t i = state.loops.size(); i-- > 0;) {
    if (!hearing.heard(state.loops[i].number) || hearing.believed(state.loops[i].number)) continue;
    GraphLoop loop = leave_graph(
        i, std::format("withdrawn: contradicts {} loops that agree with each other", hearing.believed_count()), solver,
        state);
    wait_outside(std::move(loop), false, state, events);
  }
}

/// Whatever still waits says why, once.
void explain_waiting(const LoopHearing& hearing, SmootherState& state, LoopEvents& events) {
  for (GraphLoop& loop : state.waiting) {
    if (!hearing.heard(loop.number)) continue;
    const LoopReason reason = loop.is_contradicted            ? LoopReason::kContradictsGraph
                              : hearing.believed(loop.number) ? LoopReason::kNeedsSupport
                                                              : LoopReason::kContradictsLoops;
    const bool news = loop.result.reason != reason;
    loop.result.reason = reason;
    loop.result.reason_text = text(reason);
    if (loop.is_contradicted) {
      loop.result.reason_text += std::format(": chi-square {:.1f}, at most {:.1f} is believed", loop.result.chi_square,
                                             loop.result.chi_square_bound);
    }
    if (news) events.push_back(loop);
  }
}

/// Several at once where loops in the graph were outvoted.
void forget_oldest_waiting(SmootherState& state, LoopEvents& events) {
  while (state.waiting.size() > kMostWaiting) {
    GraphLoop& forgotten = events.emplace_back(std::move(state.waiting.front()));
    state.waiting.erase(state.waiting.begin());
    forgotten.result.stage = LoopStage::kWithdrawn;
    forgotten.result.reason_text = std::format("forgotten: more than {} loops wait", kMostWaiting);
  }
}

/// Moves a loop that waits into the graph, and out of it what it contradicts.
void let_in(std::vector<GraphLoop>::iterator waiting, const BackendConfig& config, IncrementalSolver& solver,
            SmootherState& state, LoopEvents& events) {
  GraphLoop entering = std::move(*waiting);
  state.waiting.erase(waiting);
  entering.is_contradicted = false;
  const LoopEntry entry = enter_graph(entering, config, solver, state);
  if (!entry.entered) {
    events.push_back(std::move(entering));
    events.back().result.reason = LoopReason::kSolverRefused;
    events.back().result.reason_text = entry.refusal;
    return;
  }
  state.last_loop_id = std::max(state.last_loop_id, entering.result.from_id);
  events.push_back(state.loops.back());
  withdraw_contradicted(entry.rise, config, solver, state, events);
}

void enter_believed(const LoopHearing& hearing, const BackendConfig& config, IncrementalSolver& solver,
                    SmootherState& state, LoopEvents& events) {
  const ConsistencyRule rule = rule_of(config);
  std::vector<std::int32_t> entered;  // once each, or loops that contradict each other might take turns without end
  const auto deserves = [&](GraphLoop& loop) {
    if (loop.is_contradicted || std::ranges::contains(entered, loop.number) || !hearing.believed(loop.number) ||
        !hearing.supported(loop.number))
      return false;
    const GraphOpinion opinion = opinion_on(loop, rule, solver, state);
    loop.is_contradicted = !opinion.test.passed();
    if (loop.is_contradicted) note(loop, opinion.test);
    return !loop.is_contradicted;
  };
  // One that enters may support those that waited before it.
  for (auto next = std::ranges::find_if(state.waiting, deserves); next != state.waiting.end();
       next = std::ranges::find_if(state.waiting, deserves)) {
    entered.push_back(next->number);
    let_in(next, config, solver, state, events);
  }
}

/// Loops that the graph contradicts, but that agree with each other, may be the true ones.
void challenge(const std::vector<GraphLoop>& challengers, const BackendConfig& config, IncrementalSolver& solver,
               SmootherState& state, LoopEvents& events) {
  if (challengers.size() < 2) return;
  const std::optional<LoopExchange> exchange = better_exchange(challengers, config, solver, state);
  if (!exchange) return;
  for (const std::int32_t leaving : exchange->leaving) {
    const auto at = std::ranges::find(state.loops, leaving, &GraphLoop::number);
    if (at == state.loops.end()) continue;
    wait_outside(leave_graph(static_cast<std::size_t>(at - state.loops.begin()),
                             std::format("withdrawn: {} loops that contradict it agree with each other",
                                         exchange->entering.size()),
                             solver, state),
                 true, state, events);
  }
  for (const std::int32_t entering : exchange->entering) {
    const auto at = std::ranges::find(state.waiting, entering, &GraphLoop::number);
    if (at != state.waiting.end()) let_in(at, config, solver, state, events);
  }
}

void keep(GraphLoop& loop, const SmootherState& state, LoopEvents& events) {
  loop.result.stage = LoopStage::kKept;
  loop.result.reason = LoopReason::kKept;
  loop.result.reason_text =
      std::format("kept: not contradicted by {} keyframes", state.nodes.back().end.id - loop.entered_id);
  events.push_back(loop);
}

/// Loops that have stood their trial are kept: where odometry cannot tell, once the graph can without those beside it
/// that say the same. One such loop a time is looked at, with its group.
void end_trials(const BackendConfig& config, IncrementalSolver& solver, SmootherState& state, LoopEvents& events) {
  const ConsistencyRule rule = rule_of(config);
  const double root_of_bound = std::sqrt(rule.bounds.of(6));
  const std::int32_t newest = state.nodes.back().end.id;
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < state.loops.size(); ++i) {
    GraphLoop& loop = state.loops[i];
    if (loop.result.stage != LoopStage::kOnTrial || newest - loop.entered_id < config.loop_trial_keyframes) continue;
    const double open_m =
        open_distance(state.place_of(loop.result.from_id), state.place_of(loop.result.to_id), state.odometry, rule);
    if (root_of_bound * open_m <= config.loop_support_beyond_m) {
      keep(loop, state, events);
    } else {
      open.push_back(i);
    }
  }
  if (open.empty()) return;
  const std::size_t turn = static_cast<std::size_t>(newest) % open.size();
  std::vector<OutsideView> views = seen_from_outside(group_of(open[turn], rule, state), rule, solver, state);
  std::ranges::sort(views, std::ranges::greater(), &OutsideView::index);
  std::vector<GraphLoop> contradicted;
  for (const OutsideView& view : views) {
    GraphLoop& loop = state.loops[view.index];
    if (const ChiSquareTest& test = view.opinion.test; !test.passed()) {
      GraphLoop gone = leave_graph(
          view.index,
          std::format("withdrawn: only its own group speaks for it; chi-square {:.1f}, at most {:.1f} is believed",
                      test.value, test.bound),
          solver, state);
      note(gone, test);
      contradicted.push_back(gone);
      wait_outside(std::move(gone), true, state, events);
    } else if (loop.result.stage == LoopStage::kOnTrial &&
               view.opinion.largest_error_m() <= config.loop_support_beyond_m) {
      keep(loop, state, events);
    }
  }
  challenge(contradicted, config, solver, state, events);
}

}  // namespace

LoopEvents admit_loop(const LoopResult& result, const WhiteningRows& rows, const BackendConfig& config,
                      IncrementalSolver& solver, SmootherState& state) {
  GraphLoop loop;
  loop.result = result;
  loop.rows = rows;
  loop.number = state.next_loop_number++;
  loop.result.stage = LoopStage::kVerified;
  if (rows.rows() == 0) {
    loop.result.reason = LoopReason::kSolverRefused;
    loop.result.reason_text = "the loop holds no direction";
    return {loop};
  }
  const ChiSquareTest odometry = test_against_odometry(claim_of(loop, state), state.odometry, rule_of(config));
  note(loop, odometry);
  if (!odometry.passed()) {
    loop.result.reason = LoopReason::kContradictsOdometry;
    loop.result.reason_text = std::format("contradicts the odometry: chi-square {:.1f}, at most {:.1f} is believed",
                                          odometry.value, odometry.bound);
    return {loop};
  }
  const std::int32_t number = loop.number;
  state.waiting.push_back(std::move(loop));
  LoopEvents events;
  std::optional<LoopHearing> hearing(std::in_place, config, state);
  withdraw_outvoted(*hearing, solver, state, events);
  enter_believed(*hearing, config, solver, state, events);
  if (any_withdrawn(events)) {
    // Those that were outvoted come back where the graph without them contradicts the one that they had to yield to.
    hearing.emplace(config, state);
    enter_believed(*hearing, config, solver, state, events);
  }
  challenge(hearing->challengers(number), config, solver, state, events);
  explain_waiting(*hearing, state, events);
  try_again_those_before(events, state);
  forget_oldest_waiting(state, events);
  return events;
}

LoopEvents review_loops(const BackendConfig& config, IncrementalSolver& solver, SmootherState& state) {
  LoopEvents events;
  withdraw_contradicted(0.0, config, solver, state, events);
  end_trials(config, solver, state, events);
  try_again_those_before(events, state);
  try_again_one(state);
  return events;
}

LoopEvents dismiss_loops(std::int32_t from_id, std::int32_t to_id, IncrementalSolver& solver, SmootherState& state) {
  constexpr const char* kText = "withdrawn by command";
  const auto is_meant = [&](const GraphLoop& loop) {
    return loop.result.from_id == from_id && loop.result.to_id == to_id;
  };
  LoopEvents events;
  for (std::size_t i = state.loops.size(); i-- > 0;) {
    if (is_meant(state.loops[i])) events.push_back(leave_graph(i, kText, solver, state));
  }
  std::erase_if(state.waiting, [&](GraphLoop& loop) {
    if (!is_meant(loop)) return false;
    loop.result.stage = LoopStage::kWithdrawn;
    loop.result.reason = LoopReason::kWithdrawn;
    loop.result.reason_text = kText;
    events.push_back(loop);
    return true;
  });
  return events;
}

}  // namespace ignis
