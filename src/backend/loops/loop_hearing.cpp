// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_hearing.h"

#include <algorithm>
#include <ranges>

#include "backend/loops/graph_evidence.h"

namespace ignis {
namespace {

// Loops that are compared with each other: the newest ones. Older ones have proved themselves or are gone.
constexpr std::size_t kMostWitnesses = 300;
constexpr std::size_t kMostChallengers = 16;

bool is_in(const std::vector<GraphLoop>& loops, std::int32_t number) {
  return std::ranges::contains(loops, number, &GraphLoop::number);
}

}  // namespace

LoopHearing::LoopHearing(const BackendConfig& config, SmootherState& state)
    : rule_(rule_of(config)), config_(config), state_(state) {
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
    // Of two sets of one size, that without what the graph contradicts: it could not enter.
    const double doubt = loop->is_contradicted ? rule_.bounds.of(6) : 0.0;
    costs_.push_back(doubt + test_against_odometry(claims_.back(), state_.odometry, rule_).value);
  }
  believe_largest_set();
}

bool LoopHearing::believed(std::int32_t number) const {
  const auto at = place(number);
  return at && std::ranges::binary_search(believed_, *at);
}

bool LoopHearing::supported(std::int32_t number) const {
  const LoopClaim& claim = claims_[place(number).value()];
  if (open_distance(claim.from, claim.to, state_.odometry, rule_) <= config_.loop_support_beyond_m) return true;
  return std::ranges::any_of(believed_, [&](std::size_t i) {
    const std::int32_t other = numbers_[i];
    const bool testifies = is_in(state_.loops, other) || (is_in(state_.waiting, other) && are_apart(claim, claims_[i]));
    return other != number && testifies &&
           open_distance(claim, claims_[i], state_.odometry, rule_) <= config_.loop_support_beyond_m;
  });
}

std::vector<GraphLoop> LoopHearing::challengers(std::int32_t number) {
  const auto newest = std::ranges::find(state_.waiting, number, &GraphLoop::number);
  if (newest == state_.waiting.end() || !newest->is_contradicted) return {};
  std::vector<const GraphLoop*> others;
  for (const GraphLoop& loop : state_.waiting | std::views::reverse) {
    if (others.size() == kMostChallengers) break;
    if (loop.is_contradicted && loop.number != number && heard(loop.number) && agree(*newest, loop))
      others.push_back(&loop);
  }
  std::vector<std::vector<bool>> agreeing(others.size(), std::vector<bool>(others.size(), false));
  for (std::size_t i = 0; i < others.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) agreeing[i][k] = agreeing[k][i] = agree(*others[i], *others[k]);
  }
  std::vector<GraphLoop> challengers{*newest};
  const std::vector<double> cost(others.size(), 0.0);
  for (const std::size_t i : largest_agreeing_set(agreeing, cost)) challengers.push_back(*others[i]);
  return challengers;
}

std::optional<std::size_t> LoopHearing::place(std::int32_t number) const {
  const auto found = std::ranges::find(numbers_, number);
  if (found == numbers_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - numbers_.begin());
}

bool LoopHearing::are_apart(const LoopClaim& a, const LoopClaim& b) const {
  const auto distance = [&](std::size_t i, std::size_t k) {
    return state_.odometry.T_from_to(i, k).translation.norm();
  };
  return std::min(distance(a.from, b.from), distance(a.to, b.to)) >= config_.loop_support_apart_m;
}

void LoopHearing::forget_old_pairs(const std::vector<const GraphLoop*>& witnesses) {
  if (state_.agreement.size() <= kMostWitnesses * kMostWitnesses) return;
  std::vector<std::uint64_t> numbers;
  for (const GraphLoop* loop : witnesses) numbers.push_back(static_cast<std::uint64_t>(loop->number));
  std::ranges::sort(numbers);
  const auto testifies = [&](std::uint64_t number) { return std::ranges::binary_search(numbers, number); };
  boost::unordered::erase_if(state_.agreement, [&](const auto& pair) {
    return !testifies(pair.first >> 32U) || !testifies(pair.first & 0xFFFFFFFFU);
  });
}

bool LoopHearing::agree(std::size_t i, std::size_t k) {
  const auto [first, second] = std::minmax(numbers_[i], numbers_[k]);
  const std::uint64_t pair = (static_cast<std::uint64_t>(first) << 32U) | static_cast<std::uint32_t>(second);
  const auto known = state_.agreement.find(pair);
  if (known != state_.agreement.end()) return known->second;
  const bool together = test_against_each_other(claims_[i], claims_[k], state_.odometry, rule_).passed();
  state_.agreement[pair] = together;
  return together;
}

bool LoopHearing::agree(const GraphLoop& a, const GraphLoop& b) {
  return agree(place(a.number).value(), place(b.number).value());
}

void LoopHearing::believe_largest_set() {
  std::vector<std::vector<bool>> agreeing(claims_.size(), std::vector<bool>(claims_.size(), false));
  for (std::size_t i = 0; i < claims_.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) agreeing[i][k] = agreeing[k][i] = agree(i, k);
  }
  believed_ = largest_agreeing_set(agreeing, costs_);
}

}  // namespace ignis
