// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframes/corrected_trajectory.h"

#include <algorithm>

namespace ignis {
namespace {

Pose correction_at(Utime utime, const std::vector<KeyframeCorrection>& keyframes) {
  const auto next = std::ranges::lower_bound(keyframes, utime, {}, &KeyframeCorrection::utime);
  if (next == keyframes.begin()) return next->T_map_odom();
  if (next == keyframes.end()) return keyframes.back().T_map_odom();
  const KeyframeCorrection& before = *std::prev(next);
  const double ratio = seconds_between(before.utime, utime) / seconds_between(before.utime, next->utime);
  return interpolate(before.T_map_odom(), next->T_map_odom(), ratio);
}

}  // namespace

Trajectory corrected_trajectory(const Trajectory& odometry, const std::vector<KeyframeCorrection>& keyframes) {
  if (keyframes.empty()) return odometry;
  Trajectory corrected;
  corrected.reserve(odometry.size());
  for (const StampedPose& row : odometry) {
    corrected.push_back({row.utime, correction_at(row.utime, keyframes) * row.T_world_body});
  }
  return corrected;
}

}  // namespace ignis
