// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_search.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "backend/loops/loop_detector.h"
#include "backend/loops/loop_matcher.h"

namespace ignis {
namespace {

/// A candidate's surroundings.
struct Surroundings {
  std::vector<std::vector<CloudPoint>> points;
  std::vector<Pose> T_candidate_body;  ///< of each of them
  std::string problem;                 ///< why there is none; empty when all is well

  [[nodiscard]] std::vector<CloudInMap> clouds() const {
    std::vector<CloudInMap> placed;
    for (std::size_t i = 0; i < points.size(); ++i) placed.push_back({points[i], T_candidate_body[i]});
    return placed;
  }
};

/// Clouds of the candidate and its neighbours in the candidate's frame. Never reaches the keyframe that looks, nor
/// beyond those that were absorbed: what comes next then was seen elsewhere, at another time.
Surroundings surroundings_of(std::size_t candidate, std::size_t neighbours, SmootherState& state) {
  const std::size_t first = candidate > neighbours ? candidate - neighbours : 0;
  const std::size_t last = std::min(candidate + neighbours, state.poses.size() - 2);
  const Pose T_candidate_map = state.poses[candidate].T_map_body.inverse();
  Surroundings around;
  for (std::size_t i = first; i <= last; ++i) {
    const auto [earlier, later] = std::minmax(i, candidate);
    if (were_absorbed_between(state.poses[earlier].id, state.poses[later].id, state)) continue;
    CloudLookup cloud = state.clouds.find(i);
    if (!cloud.problem.empty()) return {{}, {}, std::move(cloud.problem)};
    around.points.push_back(std::move(cloud.points));
    around.T_candidate_body.push_back(T_candidate_map * state.poses[i].T_map_body);
  }
  return around;
}

LoopMatch match_in(const Surroundings& around, LoopSource& source, const Pose& T_candidate_current,
                   const BackendConfig& config, const LoopGates& gates) {
  if (around.problem.empty()) return match_loop(source, around.clouds(), T_candidate_current, config.matcher, gates);
  LoopMatch lost;
  lost.reason = LoopReason::kCloudLost;
  lost.reason_text = around.problem;
  return lost;
}

bool is_better(const LoopMatch& match, const LoopMatch& best) {
  if (match.verified() != best.verified()) return match.verified();
  return match.matched_fraction > best.matched_fraction;
}

void fill(LoopResult& result, const LoopMatch& match, std::int32_t to_id) {
  result.stage = match.verified() ? LoopStage::kVerified : LoopStage::kCandidate;
  result.reason = match.reason;
  result.reason_text = match.reason_text;
  result.to_id = to_id;
  result.correction_m = match.correction_m;
  result.correction_rad = match.correction_rad;
  result.mean_residual = match.mean_residual;
  result.matched_fraction = match.matched_fraction;
  result.overlap = match.overlap;
  result.T_to_from = match.T_map_source;
}

/// Too few keyframes or too little way since the newest loop.
bool too_soon(const SmootherState& state, const BackendConfig& config) {
  const GraphNode* last = state.node_of(state.last_loop_id);
  if (last == nullptr) return false;
  const LinkEnd& now = state.nodes.back().end;
  if (now.id - last->end.id < config.loop_min_spacing) return true;
  return (now.filter.T_odom_body.translation - last->end.filter.T_odom_body.translation).norm() <
         config.loop_min_travel_m;
}

/// Where the chi-square test against the odometry decides, the match itself must not.
LoopGates match_gates(const LoopGates& gates, const BackendConfig& config) {
  LoopGates chosen = gates;
  if (config.loop_correction_gate == "covariance") chosen.loop_max_correction_m = std::numeric_limits<double>::max();
  return chosen;
}

/// Residuals of one surface are not independent, and what does not fit is an error of all of them together.
WhiteningRows loop_noise(const LoopMatch& match, const BackendConfig& config) {
  const double misfit = config.loop_residual_weight * match.mean_residual / config.loop_floor_m;
  const double growth = std::sqrt(1.0 + misfit * misfit);
  return whitening_with_floor(match.information / config.loop_noise_inflation, growth * config.loop_floor_rad,
                              growth * config.loop_floor_m);
}

LoopProposal refusal(LoopReason reason) {
  LoopProposal proposal;
  proposal.result.reason = reason;
  proposal.result.reason_text = text(reason);
  return proposal;
}

LoopProposal best_match(const std::vector<std::size_t>& chosen, SmootherState& state, const BackendConfig& config,
                        const LoopGates& gates) {
  LoopProposal proposal;
  const KeyframePose& current = state.poses.back();
  const auto neighbours = static_cast<std::size_t>(config.matcher.neighbours);
  // Never lost: the newest cloud leaves memory only when the next one comes.
  const CloudLookup looking = state.clouds.find(state.poses.size() - 1);
  LoopSource source(looking.points, config.matcher);
  LoopMatch best;
  for (const std::size_t i : chosen) {
    const Pose T_candidate_current = state.poses[i].T_map_body.inverse() * current.T_map_body;
    const LoopMatch match = match_in(surroundings_of(i, neighbours, state), source, T_candidate_current, config, gates);
    if (match.verified()) ++proposal.result.passed;
    if (i != chosen.front() && !is_better(match, best)) continue;
    best = match;
    fill(proposal.result, match, state.poses[i].id);
    proposal.rows = loop_noise(match, config);
    if (match.verified()) break;
  }
  proposal.result.from_id = current.id;
  return proposal;
}

}  // namespace

bool is_vetoed(std::span<const LoopVeto> vetoes, std::int32_t from_id, std::int32_t to_id, int spacing) {
  // A journal may hold a veto of any two numbers.
  const auto are_near = [spacing](std::int64_t a, std::int64_t b) { return std::abs(a - b) <= spacing; };
  return std::ranges::any_of(
      vetoes, [&](const LoopVeto& veto) { return are_near(veto.from_id, from_id) && are_near(veto.to_id, to_id); });
}

LoopProposal search_loop(SmootherState& state, const BackendConfig& config, const LoopGates& gates) {
  if (!config.use_loop_closing) return refusal(LoopReason::kDisabled);
  if (too_soon(state, config)) return refusal(LoopReason::kTooSoon);
  std::vector<std::size_t> candidates = loop_candidates({state.poses, state.places, state.odometry}, gates,
                                                        config.loop_widening_sigmas, config.loop_max_widening_m);
  const auto found = static_cast<int>(candidates.size());
  if (candidates.empty()) return refusal(LoopReason::kNoCandidate);
  const KeyframePose& current = state.poses.back();
  std::erase_if(candidates, [&](std::size_t i) {
    return is_vetoed(state.vetoes, current.id, state.poses[i].id, config.loop_min_spacing);
  });
  LoopProposal proposal = candidates.empty()
                              ? refusal(LoopReason::kVetoed)
                              : best_match(choose_candidates(candidates, state.poses, current,
                                                             static_cast<std::size_t>(config.loop_max_candidates),
                                                             static_cast<std::size_t>(config.matcher.neighbours)),
                                           state, config, match_gates(gates, config));
  proposal.result.candidates = found;
  return proposal;
}

}  // namespace ignis
