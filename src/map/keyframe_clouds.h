// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "common/measurements.h"
#include "common/pose.h"
#include "map/voxel_level.h"

namespace ignis {

/// What a map is rebuilt from: for each keyframe the cloud that came with it and the live scans that followed it, all
/// in the keyframe's body frame, one point per cell of the local level. A correction of the keyframe's pose thus
/// carries everything that was seen from there, and a rebuild loses no detail.
///
/// Bounded: beyond `max_points` the cloud that is farthest (horizontally, in odom) from the newest keyframe is dropped.
class KeyframeClouds {
 public:
  KeyframeClouds(double cell_m, std::size_t max_points);

  /// Starts a keyframe; further scans are added to the keyframe with the highest id. A second cloud for an id that is
  /// known is ignored, since keyframes may be sent again.
  void add_keyframe(std::int32_t id, std::span<const CloudPoint> points_body, const Pose& T_odom_keyframe);

  /// Adds a live scan to the newest keyframe. Without any keyframe it is not kept.
  void add_scan(std::span<const CloudPoint> points_body, const Pose& T_odom_body);

  [[nodiscard]] bool contains(std::int32_t id) const { return entries_.contains(id); }
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] std::size_t points() const;
  [[nodiscard]] std::size_t bytes() const { return points() * sizeof(CloudPoint) + open_.bytes(); }
  [[nodiscard]] std::int64_t dropped() const { return dropped_; }

  /// The cloud of a keyframe as it is now; empty when it was dropped.
  [[nodiscard]] std::shared_ptr<const std::vector<CloudPoint>> cloud(std::int32_t id) const;

  void clear();

 private:
  struct Entry {
    Pose T_odom_keyframe;
    std::shared_ptr<const std::vector<CloudPoint>> points;  // complete unless the keyframe is the newest
  };

  void insert_open(std::span<const CloudPoint> points, const Pose& T_keyframe_points);
  void close_newest();
  void drop_farthest();

  std::size_t max_points_;
  std::map<std::int32_t, Entry> entries_;
  VoxelLevel open_;  // the newest keyframe's points while scans are still added
  std::size_t closed_points_ = 0;
  std::int64_t dropped_ = 0;
};

}  // namespace ignis
