// SPDX-License-Identifier: Apache-2.0
#include "backend/loop_detector.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/frames.h"

namespace ignis {
namespace {

double horizontal_distance(const Pose& a, const Pose& b) {
  const Eigen::Vector3d d = a.translation - b.translation;
  return std::hypot(d.x(), d.z());
}

double heading(const Pose& T_map_body) { return frames::to_yaw_pitch_roll(T_map_body.rotation).yaw; }

std::size_t distance_of_places(std::size_t a, std::size_t b) { return a > b ? a - b : b - a; }

}  // namespace

bool is_loop_candidate(const KeyframePose& current, const KeyframePose& earlier, const LoopGates& gates) {
  if (current.id - earlier.id < gates.loop_min_index_gap) return false;
  if (horizontal_distance(current.T_map_body, earlier.T_map_body) > gates.loop_radius_m) return false;
  const double turn = std::remainder(heading(current.T_map_body) - heading(earlier.T_map_body), 2.0 * std::numbers::pi);
  return std::abs(turn) <= gates.loop_yaw_rad;
}

std::vector<std::size_t> loop_candidates(std::span<const KeyframePose> poses, const KeyframePose& current,
                                         const LoopGates& gates) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (is_loop_candidate(current, poses[i], gates)) found.push_back(i);
  }
  return found;
}

std::vector<std::size_t> choose_candidates(std::span<const std::size_t> candidates, std::span<const KeyframePose> poses,
                                           const KeyframePose& current, std::size_t count, std::size_t spacing) {
  if (candidates.empty() || count == 0) return {};
  std::vector<std::size_t> order(candidates.begin() + 1, candidates.end());
  std::ranges::stable_sort(order, {},
                           [&](std::size_t i) { return horizontal_distance(poses[i].T_map_body, current.T_map_body); });
  std::vector<std::size_t> chosen = {candidates.front()};
  for (const std::size_t i : order) {
    if (chosen.size() == count) break;
    const bool apart = std::ranges::all_of(chosen, [&](std::size_t c) { return distance_of_places(i, c) > spacing; });
    if (apart) chosen.push_back(i);
  }
  return chosen;
}

}  // namespace ignis
