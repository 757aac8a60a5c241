// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "backend/backend_config.h"
#include "backend/factors/information.h"
#include "backend/factors/preintegration.h"
#include "backend/solver/incremental_solver.h"
#include "common/keyframe.h"

namespace gtsam {
class NonlinearFactorGraph;
class Values;
}  // namespace gtsam

/// What a keyframe brings into the graph. Keys: X(id) pose, V(id) velocity, B(id) biases.
namespace ignis {

/// The newest keyframe of the graph, to which the next one is linked.
struct LinkEnd {
  std::int32_t id = 0;
  NavState filter;    ///< as the front end saw it
  NavState estimate;  ///< as the graph places it; fields named odom are in map
};

/// What a keyframe brings, as plain numbers: all that its factors are made of, so that they can be made again from a
/// journal.
struct KeyframeLink {
  std::int32_t id = 0;
  std::int32_t previous_id = -1;  ///< -1: the first keyframe, held where odometry has it
  bool stationary = false;
  double interval_s = 0.0;       ///< since the previous one
  double velocity_sigma = 0.0;   ///< [m/s] of the first keyframe's velocity
  NavState guess;                ///< where the variables start; fields named odom are in map
  Pose T_previous_this;          ///< by odometry
  WhiteningRows odometry{0, 6};  ///< of it, by scan matching; may have no rows
  std::optional<SightedSpeed> sighted;
  std::optional<ImuSum> imu;  ///< nothing: loose odometry, velocity and bias links take its place
};

/// First keyframe: map equals odom there. Tilt is left uncertain about the two horizontal axes.
[[nodiscard]] KeyframeLink first_link(const Keyframe& keyframe, const BackendConfig& config);

/// Links a keyframe to the previous one. `use_imu` requires that imu_problem() is silent. `odometry` constrains the
/// relative pose by scan matching; it may have no rows. Along what scans leave open the sum of the IMU's samples agrees
/// with the filter's own motion (open_shifts.h).
[[nodiscard]] KeyframeLink next_link(const Keyframe& keyframe, const LinkEnd& previous, bool use_imu,
                                     const WhiteningRows& odometry, const BackendConfig& config);

void add_link_factors(const KeyframeLink& link, const BackendConfig& config, gtsam::NonlinearFactorGraph& factors);

/// Sets pose, velocity and biases of a keyframe. `state`: fields named odom are in map.
void insert_estimate(std::int32_t id, const NavState& state, gtsam::Values& values);

/// Pose, velocity and biases of a keyframe (fields named odom are in map); the other fields keep their defaults.
[[nodiscard]] NavState estimate_of(const gtsam::Values& values, std::int32_t id);
[[nodiscard]] NavState estimate_of(IncrementalSolver& solver, std::int32_t id);

}  // namespace ignis
