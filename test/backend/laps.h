// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "backend/smoother.h"
#include "backend/synthetic_drive.h"

namespace ignis::testing {

inline constexpr int kLap = 21;  ///< keyframes of the synthetic drive

/// Loops are given by hand; what has retired is kept in full, unless it stands within `spacing_m` of an earlier pass.
inline BackendConfig without_search(int estimated_keyframes, double spacing_m = 0.0) {
  BackendConfig config;
  config.use_loop_closing = false;
  config.estimated_keyframes = estimated_keyframes;
  config.retired_spacing_m = spacing_m;
  return config;
}

/// What a match between two keyframes of the drive would say, `wrong_m` off along x.
inline LoopMeasurement loop_in(const Drive& drive, int from, int to, double wrong_m = 0.0) {
  Vector6d lie = Vector6d::Zero();
  lie(3) = wrong_m;
  const auto truth = [&](int id) { return drive.T_world_body[static_cast<std::size_t>(id)]; };
  Vector6d information;
  information << Eigen::Vector3d::Constant(1.0 / (0.003 * 0.003)), Eigen::Vector3d::Constant(1.0 / (0.02 * 0.02));
  return {from, to, perturbed_in_body(truth(to).inverse() * truth(from), lie), information.asDiagonal()};
}

/// Laps of the same circle. From the second lap on every third keyframe closes a loop to the first one, if at all.
struct Laps {
  Laps(int keyframes, int estimated_keyframes, bool with_loops, unsigned seed = 3, double spacing_m = 0.0)
      : drive(make_drive({.seed = seed, .keyframes = keyframes})),
        smoother(without_search(estimated_keyframes, spacing_m), LoopGates()) {
    for (const Keyframe& keyframe : drive.keyframes) {
      last = smoother.add_keyframe(keyframe);
      EXPECT_TRUE(last.accepted()) << last.reason;
      note(last.changed);
      if (!with_loops || keyframe.id < kLap || keyframe.id % 3 != 0) continue;
      const SmootherUpdate update = smoother.add_loop(loop_in(drive, keyframe.id, keyframe.id % kLap));
      EXPECT_TRUE(update.loop->accepted()) << update.loop->reason_text;
      note(update.changed);
    }
  }

  void note(const std::vector<LoopResult>& news) { changed.insert(changed.end(), news.begin(), news.end()); }

  [[nodiscard]] double error() const {
    std::vector<Pose> poses;
    for (const KeyframePose& pose : smoother.all_poses()) poses.push_back(pose.T_map_body);
    return position_error(poses, drive.T_world_body);
  }

  Drive drive;
  Smoother smoother;
  SmootherUpdate last;
  std::vector<LoopResult> changed;  ///< of all updates
};

}  // namespace ignis::testing
