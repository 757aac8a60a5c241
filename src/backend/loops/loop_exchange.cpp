// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_exchange.h"

#include <algorithm>
#include <utility>

#include "backend/loops/graph_evidence.h"

namespace ignis {
namespace {

// Loops in the graph that may have to leave: those that say most about the newest challenger.
constexpr std::size_t kMostDefenders = 32;

/// How much each loop in the graph says about `challenger`, by the covariance of what the graph says of both.
std::vector<const GraphLoop*> defenders_against(const GraphLoop& challenger, const IncrementalSolver& solver,
                                                const SmootherState& state) {
  std::vector<IncrementalSolver::KeyPair> ends;
  for (const GraphLoop& loop : state.loops) ends.push_back(ends_of(loop));
  const Eigen::MatrixXd with_own = solver.relative_covariance(ends_of(challenger), ends);
  if (with_own.size() == 0) return {};
  std::vector<std::pair<double, const GraphLoop*>> by_influence;
  for (std::size_t i = 0; i < state.loops.size(); ++i) {
    const GraphLoop& loop = state.loops[i];
    const Eigen::MatrixXd shared =
        challenger.rows * with_own.middleCols<6>(6 * static_cast<Eigen::Index>(i)) * loop.rows.transpose();
    by_influence.emplace_back(shared.squaredNorm(), &loop);
  }
  std::ranges::stable_sort(by_influence, std::ranges::greater(), [](const auto& entry) { return entry.first; });
  if (by_influence.size() > kMostDefenders) by_influence.resize(kMostDefenders);
  std::vector<const GraphLoop*> defenders;
  for (const auto& entry : by_influence) defenders.push_back(entry.second);
  return defenders;
}

/// Costs over what is believed of them.
class Trial {
 public:
  Trial(LoopEvidence evidence, double probability) : evidence_(std::move(evidence)), bounds_(probability) {}

  [[nodiscard]] bool is_in(std::size_t i) const { return evidence_.is_in(i); }
  [[nodiscard]] bool is_believed(std::size_t i) const { return share(i) <= 1.0; }
  void move(std::size_t i) { evidence_.move(i); }

  /// Takes out, worst first, what the others contradict; of `spared` nothing.
  void withdraw_contradicted(const std::vector<bool>& spared) {
    while (const auto worst = most(true, spared)) evidence_.move(*worst);
  }

  /// Lets in, best first, what agrees, but for `left_out`.
  void admit_believed(const std::vector<bool>& left_out) {
    while (const auto best = most(false, left_out)) evidence_.move(*best);
  }

 private:
  [[nodiscard]] double share(std::size_t i) const { return evidence_.cost(i) / bounds_.of(evidence_.directions(i)); }

  /// The one inside whose share is farthest above 1, or the one outside whose share is farthest below.
  [[nodiscard]] std::optional<std::size_t> most(bool inside, const std::vector<bool>& left_out) const {
    std::optional<std::size_t> most;
    double extreme = 1.0;
    for (std::size_t i = 0; i < evidence_.size(); ++i) {
      if (evidence_.is_in(i) != inside || left_out[i]) continue;
      const double own = share(i);
      if (inside ? !(own > extreme) : !(own < extreme)) continue;
      extreme = own;
      most = i;
    }
    return most;
  }

  LoopEvidence evidence_;
  ChiSquareBounds bounds_;
};

}  // namespace

std::optional<LoopExchange> better_exchange(std::span<const GraphLoop> challengers, const BackendConfig& config,
                                            const IncrementalSolver& solver, const SmootherState& state) {
  std::vector<const GraphLoop*> loops;
  for (const GraphLoop& challenger : challengers) loops.push_back(&challenger);
  std::ranges::copy(defenders_against(challengers.front(), solver, state), std::back_inserter(loops));
  std::optional<LoopEvidence> evidence = evidence_of(loops, solver, state);
  if (!evidence) return std::nullopt;
  Trial trial(std::move(*evidence), config.loop_consistency_probability);

  std::vector<bool> challenges(loops.size(), false);
  std::fill_n(challenges.begin(), challengers.size(), true);
  for (std::size_t i = 0; i < challengers.size(); ++i) trial.move(i);
  trial.withdraw_contradicted(challenges);
  // Challengers must not only have each other: what stays of the graph has to believe each of them by itself.
  for (std::size_t i = 0; i < challengers.size(); ++i) {
    if (trial.is_in(i)) trial.move(i);
  }
  std::vector<bool> refused(loops.size(), false);
  for (std::size_t i = 0; i < challengers.size(); ++i) refused[i] = !trial.is_believed(i);
  std::vector<bool> not_yet = refused;
  std::fill(not_yet.begin() + std::ssize(challengers), not_yet.end(), true);
  trial.admit_believed(not_yet);
  trial.admit_believed(refused);  // some had left for the sake of one that left later

  LoopExchange exchange;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const bool was_in = i >= challengers.size();
    if (was_in && !trial.is_in(i)) exchange.leaving.push_back(loops[i]->number);
    if (!was_in && trial.is_in(i)) exchange.entering.push_back(loops[i]->number);
  }
  if (exchange.leaving.empty() || exchange.entering.size() <= exchange.leaving.size()) return std::nullopt;
  return exchange;
}

}  // namespace ignis
