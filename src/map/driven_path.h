// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "common/pose.h"

namespace ignis {

/// The driven path twice: as odometry saw it, and as the corrected keyframes place it. Each point remembers the
/// keyframe that it followed, so a correction moves the whole path without storing it twice. Bounded: when kMaxPoints
/// is reached every other point goes and the spacing doubles.
class DrivenPath {
 public:
  static constexpr std::size_t kMaxPoints = 4000;
  static constexpr double kFirstSpacing = 0.2;  ///< [m]

  /// Adds the vehicle's position if it is far enough from the last point. `keyframe_id`: newest keyframe, or -1.
  void add(const Eigen::Vector3d& p_odom, std::int32_t keyframe_id);

  void clear();

  /// Positions as odometry saw them [m, odom].
  [[nodiscard]] std::vector<Eigen::Vector3f> odometry() const;

  /// Positions in map [m]; `T_map_odom_at` gives the correction that belongs to a keyframe.
  [[nodiscard]] std::vector<Eigen::Vector3f> corrected(
      const std::function<Pose(std::int32_t keyframe_id)>& T_map_odom_at) const;

  [[nodiscard]] std::size_t size() const { return points_.size(); }

 private:
  struct Point {
    Eigen::Vector3d p_odom;
    std::int32_t keyframe_id;
  };

  std::vector<Point> points_;
  double spacing_ = kFirstSpacing;
};

}  // namespace ignis
