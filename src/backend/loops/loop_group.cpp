// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_group.h"

#include <algorithm>
#include <cstdlib>
#include <optional>

namespace ignis {
namespace {

constexpr int kBeside = 10;  // keyframes between the ends of two loops, at most

bool are_beside(const GraphLoop& a, const GraphLoop& b) {
  return std::abs(a.result.from_id - b.result.from_id) <= kBeside &&
         std::abs(a.result.to_id - b.result.to_id) <= kBeside;
}

}  // namespace

std::vector<std::size_t> group_of(std::size_t index, const ConsistencyRule& rule, const SmootherState& state) {
  std::vector<std::size_t> group{index};
  for (std::size_t known = 0; known < group.size(); ++known) {
    const GraphLoop& member = state.loops[group[known]];
    const LoopClaim claim = claim_of(member, state);
    for (std::size_t i = 0; i < state.loops.size() && group.size() < kLargestGroup; ++i) {
      if (std::ranges::contains(group, i) || !are_beside(member, state.loops[i])) continue;
      if (test_against_each_other(claim, claim_of(state.loops[i], state), state.odometry, rule).passed())
        group.push_back(i);
    }
  }
  return group;
}

std::vector<OutsideView> seen_from_outside(const std::vector<std::size_t>& group, const ConsistencyRule& rule,
                                           const IncrementalSolver& solver, const SmootherState& state) {
  std::vector<const GraphLoop*> loops;
  for (const std::size_t index : group) loops.push_back(&state.loops[index]);
  std::optional<LoopEvidence> evidence = evidence_of(loops, solver, state);
  if (!evidence) return {};
  for (std::size_t i = 0; i < group.size(); ++i) evidence->move(i);
  std::vector<OutsideView> views;
  for (std::size_t i = 0; i < group.size(); ++i) {
    views.push_back({group[i], opinion_on(*evidence, i, rule)});
    // Errors of odometry are correlated: the graph is less sure of itself than it says.
    views.back().opinion.test.value /= rule.sigma_scale * rule.sigma_scale;
  }
  return views;
}

}  // namespace ignis
