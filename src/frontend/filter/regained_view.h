// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/byte_codec.h"

namespace ignis {

/// Structure that comes into view along a direction that the scan before did not observe.
///
/// It was mapped on the way here, at a pose that nothing held along that direction. A scan that is matched against it
/// measures the pose from there on; what the position was off by when it came into view stays.
class RegainedView {
 public:
  /// After a scan that left the position known with `position_covariance` [m^2, odom axes] and did not observe shifts
  /// along the unit axes `blind` (odom).
  void remember(const Eigen::Matrix3d& position_covariance, std::span<const Eigen::Vector3d> blind);

  /// At the next scan, which does not observe `blind` and leaves the position known with `in_map` against what it was
  /// matched with: `shift`, the covariance of that, so wide that both make up what was remembered along each axis that
  /// has come into view. All [m^2, odom axes].
  [[nodiscard]] Eigen::Matrix3d widened(const Eigen::Matrix3d& shift, std::span<const Eigen::Vector3d> blind,
                                        const Eigen::Matrix3d& in_map) const;

  /// From here on the position is told against this one; what was blind still is.
  void begin_here() { position_covariance_.setZero(); }

 private:
  Eigen::Matrix3d position_covariance_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d blind_ = Eigen::Matrix3d::Zero();  ///< projects on the shifts that were not observed

  friend void transfer(auto& io, FieldsOf<RegainedView> auto& view) {
    io.matrix(view.position_covariance_);
    io.matrix(view.blind_);
  }
};

/// Adds the part of a unit axis that is across to orthonormal `axes`, unless it is within 30 degrees of them.
void add_axis(std::vector<Eigen::Vector3d>& axes, Eigen::Vector3d axis);

/// Onto the space that orthonormal `axes` span.
[[nodiscard]] Eigen::Matrix3d projector_on(std::span<const Eigen::Vector3d> axes);

/// `shift` so wide that it and `in_map` make up at least `position_covariance` along each of the unit axes. All [m^2,
/// odom axes].
[[nodiscard]] Eigen::Matrix3d widened_to(const Eigen::Matrix3d& position_covariance, Eigen::Matrix3d shift,
                                         const Eigen::Matrix3d& in_map, std::span<const Eigen::Vector3d> axes);

}  // namespace ignis
