// SPDX-License-Identifier: Apache-2.0
#include "backend/loop_admission.h"

#include <algorithm>
#include <format>
#include <optional>
#include <utility>

#include "backend/loop_consistency.h"
#include "backend/loop_trial.h"

namespace ignis {
namespace {

// Loops that are compared with each other: the newest ones. Older ones have proved themselves or are gone.
constexpr std::size_t kMostWitnesses = 300;
constexpr std::size_t kMostWaiting = 100;  // the oldest is forgotten
// [1/rad^2, 1/m^2] Information that stands for none in the directions that a loop leaves free.
const Matrix6d kNothingKnown = 1e-6 * Matrix6d::Identity();

ConsistencyRule rule_of(const BackendConfig& config) {
  return {config.loop_drift_scale, ChiSquareBounds(config.loop_consistency_probability)};
}

LoopClaim claim_of(const GraphLoop& loop, const SmootherState& state) {
  return {state.place_of(loop.result.from_id), state.place_of(loop.result.to_id), loop.result.T_to_from,
          covariance_of(loop.rows, kNothingKnown), static_cast<int>(loop.rows.rows())};
}

void note(GraphLoop& loop, const ChiSquareTest& test) {
  loop.result.chi_square = test.value;
  loop.result.chi_square_bound = test.bound;
}

/// The court in session: one claim per loop that may testify, those in the graph first.
class Hearing {
 public:
  Hearing(const BackendConfig& config, SmootherState& state) : rule_(rule_of(config)), config_(config), state_(state) {
    std::vector<const GraphLoop*> witnesses;
    for (const GraphLoop& loop : state.loops) witnesses.push_back(&loop);
    for (const GraphLoop& loop : state.waiting) witnesses.push_back(&loop);
    if (witnesses.size() > kMostWitnesses) {
      std::ranges::sort(witnesses, {}, &GraphLoop::number);
      witnesses.erase(witnesses.begin(), witnesses.end() - kMostWitnesses);
    }
    forget_old_pairs(witnesses);
    for (const GraphLoop* loop : witnesses) {
      numbers_.push_back(loop->number);
      claims_.push_back(claim_of(*loop, state_));
    }
    believe_largest_set();
  }

  [[nodiscard]] bool heard(std::int32_t number) const { return place(number).has_value(); }
  [[nodiscard]] bool believed(std::int32_t number) const {
    const auto at = place(number);
    return at && std::ranges::binary_search(believed_, *at);
  }
  [[nodiscard]] std::size_t believed_count() const { return believed_.size(); }

  /// Odometry pins the loop down by itself, or another believed loop does: one that is in the graph, or one from so far
  /// away that a place that merely looks alike would not explain both.
  [[nodiscard]] bool supported(std::int32_t number) const {
    const LoopClaim& claim = claims_[place(number).value()];
    if (open_distance(claim.from, claim.to, state_.odometry, rule_) <= config_.loop_support_beyond_m) return true;
    return std::ranges::any_of(believed_, [&](std::size_t i) {
      const std::int32_t other = numbers_[i];
      const bool testifies =
          is_in(state_.loops, other) || (is_in(state_.waiting, other) && are_apart(claim, claims_[i]));
      return other != number && testifies &&
             open_distance(claim, claims_[i], state_.odometry, rule_) <= config_.loop_support_beyond_m;
    });
  }

 private:
  [[nodiscard]] std::optional<std::size_t> place(std::int32_t number) const {
    const auto found = std::ranges::find(numbers_, number);
    if (found == numbers_.end()) return std::nullopt;
    return static_cast<std::size_t>(found - numbers_.begin());
  }

  [[nodiscard]] static bool is_in(const auto& loops, std::int32_t number) {
    return std::ranges::find(loops, number, &GraphLoop::number) != loops.end();
  }

  [[nodiscard]] bool are_apart(const LoopClaim& a, const LoopClaim& b) const {
    const auto distance = [&](std::size_t i, std::size_t k) {
      return state_.odometry.T_from_to(i, k).translation.norm();
    };
    return std::min(distance(a.from, b.from), distance(a.to, b.to)) >= config_.loop_support_apart_m;
  }

  /// Pairs with a loop that testifies no more are hardly ever asked for again.
  void forget_old_pairs(const std::vector<const GraphLoop*>& witnesses) {
    if (state_.agreement.size() <= kMostWitnesses * kMostWitnesses) return;
    std::vector<std::uint64_t> numbers;
    for (const GraphLoop* loop : witnesses) numbers.push_back(static_cast<std::uint64_t>(loop->number));
    std::ranges::sort(numbers);
    const auto testifies = [&](std::uint64_t number) { return std::ranges::binary_search(numbers, number); };
    boost::unordered::erase_if(state_.agreement, [&](const auto& pair) {
      return !testifies(pair.first >> 32U) || !testifies(pair.first & 0xFFFFFFFFU);
    });
  }

  bool agree(std::size_t i, std::size_t k) {
    const auto [first, second] = std::minmax(numbers_[i], numbers_[k]);
    const std::uint64_t pair = (static_cast<std::uint64_t>(first) << 32U) | static_cast<std::uint32_t>(second);
    const auto known = state_.agreement.find(pair);
    if (known != state_.agreement.end()) return known->second;
    const bool together = test_against_each_other(claims_[i], claims_[k], state_.odometry, rule_).passed();
    state_.agreement[pair] = together;
    return together;
  }

  void believe_largest_set() {
    std::vector<std::vector<bool>> agreeing(claims_.size(), std::vector<bool>(claims_.size(), false));
    std::vector<double> cost;
    for (std::size_t i = 0; i < claims_.size(); ++i) {
      cost.push_back(test_against_odometry(claims_[i], state_.odometry, rule_).value);
      for (std::size_t k = 0; k < i; ++k) agreeing[i][k] = agreeing[k][i] = agree(i, k);
    }
    believed_ = largest_agreeing_set(agreeing, cost);
  }

  ConsistencyRule rule_;
  const BackendConfig& config_;
  SmootherState& state_;
  std::vector<std::int32_t> numbers_;  ///< of the loops that testify
  std::vector<LoopClaim> claims_;      ///< theirs
  std::vector<std::size_t> believed_;  ///< places in claims_, ascending
};

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
    events.push_back(std::move(loop));
    // With the culprit gone, what the newest loop had raised says nothing any more; its own error does.
    newest_rise = 0.0;
  }
}

/// Loops in the graph that the larger set contradicts go back among those that wait.
void withdraw_outvoted(const Hearing& hearing, IncrementalSolver& solver, SmootherState& state, LoopEvents& events) {
  for (std::size_t i = state.loops.size(); i-- > 0;) {
    if (!hearing.heard(state.loops[i].number) || hearing.believed(state.loops[i].number)) continue;
    GraphLoop loop = leave_graph(
        i, std::format("withdrawn: contradicts {} loops that agree with each other", hearing.believed_count()), solver,
        state);
    events.push_back(loop);
    loop.result.stage = LoopStage::kVerified;
    state.waiting.push_back(std::move(loop));
  }
}

/// Whatever still waits says why, once.
void explain_waiting(const Hearing& hearing, SmootherState& state, LoopEvents& events) {
  for (GraphLoop& loop : state.waiting) {
    if (!hearing.heard(loop.number)) continue;
    const LoopReason reason = hearing.believed(loop.number) ? LoopReason::kNeedsSupport : LoopReason::kContradictsLoops;
    const bool news = loop.result.reason != reason;
    loop.result.reason = reason;
    loop.result.reason_text = text(reason);
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

void enter_believed(const Hearing& hearing, const BackendConfig& config, IncrementalSolver& solver,
                    SmootherState& state, LoopEvents& events) {
  const auto deserves = [&](const GraphLoop& loop) {
    return hearing.believed(loop.number) && hearing.supported(loop.number);
  };
  // One that enters may support those that waited before it.
  for (auto next = std::ranges::find_if(state.waiting, deserves); next != state.waiting.end();
       next = std::ranges::find_if(state.waiting, deserves)) {
    GraphLoop entering = std::move(*next);
    state.waiting.erase(next);
    const LoopEntry entry = enter_graph(entering, config, solver, state);
    if (!entry.entered) {
      events.push_back(std::move(entering));
      events.back().result.reason = LoopReason::kSolverRefused;
      events.back().result.reason_text = entry.refusal;
      continue;
    }
    state.last_loop_id = std::max(state.last_loop_id, entering.result.from_id);
    events.push_back(state.loops.back());
    withdraw_contradicted(entry.rise, config, solver, state, events);
  }
  explain_waiting(hearing, state, events);
  forget_oldest_waiting(state, events);
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
  state.waiting.push_back(std::move(loop));
  LoopEvents events;
  const Hearing hearing(config, state);
  withdraw_outvoted(hearing, solver, state, events);
  enter_believed(hearing, config, solver, state, events);
  return events;
}

LoopEvents review_loops(const BackendConfig& config, IncrementalSolver& solver, SmootherState& state) {
  LoopEvents events;
  withdraw_contradicted(0.0, config, solver, state, events);
  for (GraphLoop& loop : state.loops) {
    const int age = state.nodes.back().end.id - loop.entered_id;
    if (loop.result.stage != LoopStage::kOnTrial || age < config.loop_trial_keyframes) continue;
    loop.result.stage = LoopStage::kKept;
    loop.result.reason = LoopReason::kKept;
    loop.result.reason_text = std::format("kept: not contradicted by {} keyframes", age);
    events.push_back(loop);
  }
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
