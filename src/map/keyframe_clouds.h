// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/measurements.h"
#include "common/pose.h"
#include "map/cell_set.h"
#include "map/free_space.h"
#include "map/stored_cloud.h"

namespace ignis {

/// Everything that the map is made of: for each keyframe the cloud that came with it and the live scans that followed
/// it, all in the keyframe's body frame. A correction of the keyframe's pose thus carries everything that was seen from
/// there.
///
/// A keyframe is open while scans are added to it: the newest one. Of each cell (of the local level's size, body frame)
/// it keeps the point that came first; later points say nothing new, so what is kept is known at once and never
/// changes. What is seen before the first keyframe belongs to a stand-in with the id kBeforeFirst.
///
/// Bounded: beyond `max_points` the clouds that are farthest (horizontally, in odom) from the newest keyframe are to be
/// dropped, a sixteenth of the bound at a time, since what they leave has to be filled from the others. When the open
/// one alone is that large, it takes no more. Memory: 16 bytes per point, 20 per block of 2 m, and for the open
/// keyframe 19 to 39 per block of 4x4x4 cells beside. With rays followed, 4 bytes per free cell.
class KeyframeClouds {
 public:
  static constexpr std::int32_t kBeforeFirst = -1;

  /// The points of a cloud that were new, in the body frame of its keyframe. Valid until the next call.
  struct Kept {
    std::int32_t id = 0;
    std::span<const CloudPoint> points;
    std::span<const std::uint32_t> which;  ///< their places among the points that were offered
    std::size_t unusable = 0;              ///< points that no map can hold
  };

  KeyframeClouds(double cell_m, std::size_t max_points);

  /// From here on the rays of the scans are followed as well, for the cells that they find free.
  void follow_rays(FreeSpace free_space) { open_free_ = std::move(free_space); }

  /// Starts a keyframe; further scans are added to the keyframe with the highest id. A keyframe below that was lost on
  /// its way and sent again: its scans went to its predecessor. `id` is not in store.
  Kept add_keyframe(std::int32_t id, std::span<const CloudPoint> points_body, const Pose& T_odom_keyframe);

  /// Adds a live scan to the newest keyframe.
  Kept add_scan(std::span<const CloudPoint> points_body, const Pose& T_odom_body);

  /// The farthest clouds, when there are more points than the bound allows: as many as make room for a while.
  [[nodiscard]] std::vector<std::int32_t> beyond_bound() const;
  void drop(std::span<const std::int32_t> ids);

  void clear();

  [[nodiscard]] bool contains(std::int32_t id) const { return entries_.contains(id); }
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  [[nodiscard]] std::size_t points() const { return closed_points_ + open_points_.size(); }
  [[nodiscard]] std::size_t bytes() const;
  [[nodiscard]] std::int64_t dropped() const { return dropped_; }  ///< clouds, since the last clear()

  /// The keyframe that takes the scans.
  [[nodiscard]] std::optional<std::int32_t> open_id() const;
  [[nodiscard]] const Pose& T_odom_keyframe(std::int32_t id) const { return entries_.at(id).T_odom_keyframe; }

  /// A cloud in store.
  [[nodiscard]] StoredCloud view(std::int32_t id) const;

  /// The same to keep, for another thread; the open one is copied.
  [[nodiscard]] SharedCloud share(std::int32_t id) const;

 private:
  struct Entry {
    Pose T_odom_keyframe;
    SharedCloud cloud;  // none while open
  };

  Kept insert_open(std::span<const CloudPoint> points, const Pose& T_keyframe_points, bool are_rays);
  void close_newest();

  double cell_m_;
  std::size_t max_points_;
  std::map<std::int32_t, Entry> entries_;
  std::vector<CloudPoint> open_points_;
  std::vector<std::uint32_t> which_;  // of Kept
  CellSet open_cells_;
  std::optional<FreeSpace> open_free_;
  std::size_t blocks_ = 0;  // of the closed ones, as are the free cells
  std::size_t free_cells_ = 0;
  std::size_t closed_points_ = 0;
  std::int64_t dropped_ = 0;
};

}  // namespace ignis
