// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "backend/keyframe_pose.h"
#include "backend/keyframes/odometry_chain.h"
#include "backend/loops/place_index.h"
#include "common/loop_gates.h"

namespace ignis {

/// How much farther than the gates two keyframes may be apart, because nobody knows better.
struct GateWidening {
  double distance_m = 0.0;
  double yaw_rad = 0.0;
};

/// `sigmas` times the uncertainty of the newer keyframe's horizontal place and heading relative to the older one;
/// `T_map_body` of the newer, `covariance` in its body axes (attitude then position). Never more than `most_m`; the
/// heading never more than the gate can use.
[[nodiscard]] GateWidening gate_widening(const Pose& T_map_body, const Matrix6d& covariance, double sigmas,
                                         double most_m);

/// The geometric candidate test of the reference: horizontal distance (X and Z) at most loop_radius_m, heading
/// difference at most loop_yaw_rad, both widened, and at least loop_min_index_gap keyframes back.
[[nodiscard]] bool is_loop_candidate(const KeyframePose& current, const KeyframePose& earlier, const LoopGates& gates,
                                     const GateWidening& widening = {});

/// Where candidates are looked for. The three share their indices.
struct CandidateSpace {
  std::span<const KeyframePose> poses;  ///< ascending ids; the last one looks
  const PlaceIndex& places;
  const OdometryChain& odometry;
};

/// Indices of the candidates for the newest keyframe, oldest first. Gates are widened by `sigmas` times the relative
/// uncertainty of odometry, at most by `most_m`.
[[nodiscard]] std::vector<std::size_t> loop_candidates(const CandidateSpace& space, const LoopGates& gates,
                                                       double sigmas, double most_m);

/// Which candidates are worth a scan match: the oldest, then the nearest ones that lie more than `spacing` keyframes
/// away from those already chosen (their local maps would overlap), at most `count` in all.
[[nodiscard]] std::vector<std::size_t> choose_candidates(std::span<const std::size_t> candidates,
                                                         std::span<const KeyframePose> poses,
                                                         const KeyframePose& current, std::size_t count,
                                                         std::size_t spacing);

}  // namespace ignis
