// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_detector.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "common/frames.h"

namespace ignis {
namespace {

double horizontal_distance(const Pose& a, const Pose& b) {
  const Eigen::Vector3d d = a.translation - b.translation;
  return std::hypot(d.x(), d.z());
}

double heading(const Pose& T_map_body) { return frames::to_yaw_pitch_roll(T_map_body.rotation).yaw; }

}  // namespace

GateWidening gate_widening(const Pose& T_map_body, const Matrix6d& covariance, double sigmas, double most_m) {
  const Eigen::Matrix3d R = T_map_body.rotation.toRotationMatrix();
  const Eigen::Matrix3d attitude = R * covariance.topLeftCorner<3, 3>() * R.transpose();
  const Eigen::Matrix3d position = R * covariance.bottomRightCorner<3, 3>() * R.transpose();
  // The larger axis of the horizontal ellipse is at most the root of the trace.
  const double distance = std::sqrt(std::max(0.0, position(0, 0) + position(2, 2)));
  const double yaw = std::sqrt(std::max(0.0, attitude(1, 1)));
  return {std::min(most_m, sigmas * distance), std::min(std::numbers::pi, sigmas * yaw)};
}

bool is_loop_candidate(const KeyframePose& current, const KeyframePose& earlier, const LoopGates& gates,
                       const GateWidening& widening) {
  if (current.id - earlier.id < gates.loop_min_index_gap) return false;
  const double distance = horizontal_distance(current.T_map_body, earlier.T_map_body);
  if (distance > gates.loop_radius_m + widening.distance_m) return false;
  const double turn = std::remainder(heading(current.T_map_body) - heading(earlier.T_map_body), 2.0 * std::numbers::pi);
  return std::abs(turn) <= gates.loop_yaw_rad + widening.yaw_rad;
}

std::vector<std::size_t> loop_candidates(const CandidateSpace& space, const LoopGates& gates, double sigmas,
                                         double most_m) {
  if (space.poses.empty()) return {};
  const KeyframePose& current = space.poses.back();
  const std::size_t newest = space.poses.size() - 1;
  const auto widening = [&](std::size_t i) {
    return gate_widening(current.T_map_body, space.odometry.covariance(i, newest), sigmas, most_m);
  };
  // Odometry knows the oldest place worst.
  const double reach = gates.loop_radius_m + widening(0).distance_m;
  std::vector<std::size_t> found;
  for (const std::size_t i : space.places.around(current.T_map_body.translation, reach)) {
    if (is_loop_candidate(current, space.poses[i], gates, widening(i))) found.push_back(i);
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
    const bool apart = std::ranges::all_of(chosen, [&](std::size_t c) {
      return std::abs(poses[i].id - poses[c].id) > static_cast<std::int32_t>(spacing);
    });
    if (apart) chosen.push_back(i);
  }
  return chosen;
}

}  // namespace ignis
