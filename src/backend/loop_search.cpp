// SPDX-License-Identifier: Apache-2.0
#include "backend/loop_search.h"

#include <algorithm>
#include <format>

#include "backend/loop_detector.h"
#include "backend/loop_matcher.h"

namespace ignis {
namespace {

/// Clouds of the candidate and its neighbours in the candidate's frame. Never reaches the keyframe that looks.
std::vector<Eigen::Vector3d> local_map(std::size_t candidate, std::size_t neighbours,
                                       std::span<const KeyframePose> poses,
                                       std::span<const std::vector<CloudPoint>> clouds) {
  const std::size_t first = candidate > neighbours ? candidate - neighbours : 0;
  const std::size_t last = std::min(candidate + neighbours, poses.size() - 2);
  const Pose T_candidate_map = poses[candidate].T_map_body.inverse();
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = first; i <= last; ++i) {
    const Pose T_candidate_body = T_candidate_map * poses[i].T_map_body;
    for (const CloudPoint& point : clouds[i]) {
      if (point.position.allFinite()) points.push_back(T_candidate_body * point.position.cast<double>());
    }
  }
  return points;
}

bool is_better(const LoopMatch& match, const LoopMatch& best) {
  if (match.verified() != best.verified()) return match.verified();
  return match.matched_fraction > best.matched_fraction;
}

void fill(LoopResult& result, const LoopMatch& match, std::int32_t to_id) {
  result.reason = match.reason;
  result.reason_text = match.reason_text;
  result.to_id = to_id;
  result.correction_m = match.correction_m;
  result.correction_rad = match.correction_rad;
  result.mean_residual = match.mean_residual;
  result.matched_fraction = match.matched_fraction;
  result.T_to_from = match.T_map_source;
}

}  // namespace

LoopProposal search_loop(std::span<const KeyframePose> poses, std::span<const std::vector<CloudPoint>> clouds,
                         const BackendConfig& config, const LoopGates& gates) {
  LoopProposal proposal;
  const KeyframePose& current = poses.back();
  const std::vector<std::size_t> candidates = loop_candidates(poses, current, gates);
  proposal.result.candidates = static_cast<int>(candidates.size());
  if (candidates.empty()) {
    proposal.result.reason_text = text(LoopReason::kNoCandidate);
    return proposal;
  }
  proposal.result.from_id = current.id;
  const auto neighbours = static_cast<std::size_t>(config.matcher.neighbours);
  const std::vector<std::size_t> chosen =
      choose_candidates(candidates, poses, current, static_cast<std::size_t>(config.loop_max_candidates), neighbours);
  LoopMatch best;
  for (const std::size_t i : chosen) {
    const Pose T_candidate_current = poses[i].T_map_body.inverse() * current.T_map_body;
    const LoopMatch match =
        match_loop(clouds.back(), local_map(i, neighbours, poses, clouds), T_candidate_current, config.matcher, gates);
    if (match.verified()) ++proposal.result.passed;
    if (i != chosen.front() && !is_better(match, best)) continue;
    best = match;
    fill(proposal.result, match, poses[i].id);
    proposal.information = match.information;
  }
  return proposal;
}

}  // namespace ignis
