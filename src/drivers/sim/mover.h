// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "common/pose.h"
#include "drivers/sim/solids.h"

namespace ignis::sim {

/// A place on the way of something that moves.
struct MoverStop {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m] world
  double rest = 0.0;                                   ///< [s] to stand here before going on
};

/// Solids that move together on straight legs at constant speed and always face where they go, such as a forklift.
/// Their own frame is the body's: +X right, +Y up, -Z forward. They turn at once at a stop. Before the start they stand
/// at the first stop, after the end at the last one; a loop goes from the last stop back to the first, for ever.
class Mover {
 public:
  /// At least one stop; consecutive ones apart from each other, also last and first of a loop. speed [m/s] above zero.
  Mover(std::vector<Solid> solids, const std::vector<MoverStop>& stops, double speed, double start, bool loop);

  [[nodiscard]] Pose T_world_mover(double time) const;  ///< time [s]

  /// As of the solids, at an instant [s].
  [[nodiscard]] std::optional<Hit> cast(const Ray& ray, double limit, double time) const;
  [[nodiscard]] double clearance(const Eigen::Vector3d& point, double time) const;

 private:
  struct Leg {
    double begin = 0.0;  ///< [s] after the start
    Pose T_world_mover;  ///< at the begin
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  };

  void add_stop(const MoverStop& from, const Eigen::Vector3d& to, double speed);
  void append(double duration, const Pose& T_world_mover, const Eigen::Vector3d& velocity);

  std::vector<Solid> solids_;
  std::vector<Leg> legs_;
  double start_;
  double duration_ = 0.0;  ///< [s] of all legs
  bool loop_;
  double reach_ = 0.0;  ///< [m] radius of a ball around the mover's origin that holds all solids
};

}  // namespace ignis::sim
