// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "backend/backend_config.h"
#include "backend/information.h"
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
  Utime utime = 0;
  Pose T_odom_body;   ///< as the front end saw it
  NavState estimate;  ///< as the graph places it; fields named odom are in map
};

/// First keyframe: map equals odom there. Tilt is left uncertain about the two horizontal axes.
void add_first_keyframe(const Keyframe& keyframe, const BackendConfig& config, gtsam::NonlinearFactorGraph& factors,
                        gtsam::Values& values);

/// Links a keyframe to the previous one. `use_imu` false: loose odometry, velocity and bias links take its place.
/// `odometry` constrains the relative pose by scan matching; it may have no rows.
void add_next_keyframe(const Keyframe& keyframe, const LinkEnd& previous, bool use_imu, const WhiteningRows& odometry,
                       const BackendConfig& config, gtsam::NonlinearFactorGraph& factors, gtsam::Values& values);

/// Whitening of loose odometry.
[[nodiscard]] WhiteningRows loose_rows(const BackendConfig& config);

/// Pose, velocity and biases of a keyframe (fields named odom are in map); the other fields keep their defaults.
[[nodiscard]] NavState estimate_of(const gtsam::Values& values, std::int32_t id);

}  // namespace ignis
