// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "common/keyframe.h"
#include "map/driven_path.h"
#include "map/keyframe_clouds.h"
#include "map/three_level_map.h"

namespace ignis {

/// The corrected pose of one keyframe, frame map.
struct CorrectedPose {
  std::int32_t id = 0;
  Pose T_map_keyframe;
};

/// Everything a rebuild needs, shared or copied, so that it can run on another thread.
struct RebuildJob {
  MapConfig config;
  std::vector<PlacedCloud> clouds;  ///< ascending keyframe ids
  Pose T_map_body;                  ///< around which the windows lie
};

/// Builds the map of a job: the same voxels on any thread and after any history.
[[nodiscard]] ThreeLevelMap rebuild(const RebuildJob& job);

/// The voxel map of a drive: live scans enter it where odometry and the current correction place them; when the back
/// end has moved the keyframes, it is rebuilt from their clouds. Frames: `odom` of the front end, `map` of the back
/// end.
///
/// A rebuild is begun (begin_rebuild), run anywhere (rebuild) and taken over (finish_rebuild). Meanwhile the old map
/// stays in use; scans and keyframes that arrive between are added to the new one. Not thread-safe, no clocks.
class LiveMap {
 public:
  explicit LiveMap(const MapConfig& config);

  /// A scan in the body frame. Returns what became of its points.
  InsertCounts insert_scan(std::span<const CloudPoint> points_body, const Pose& T_odom_body);

  /// A keyframe; known ids are ignored. False when its pose is unusable.
  bool add_keyframe(const Keyframe& keyframe);

  /// The back end's newest state: poses that moved and the correction of odom. Poses that no map can hold are ignored
  /// and counted.
  void correct(const Pose& T_map_odom, std::span<const CorrectedPose> poses, std::int32_t revision = 0);

  /// A loop factor entered or left the graph. One that entered makes the next correction rebuild the map.
  void add_loop(std::int32_t from_id, std::int32_t to_id);
  void remove_loop(std::int32_t from_id, std::int32_t to_id);

  /// Forgets everything: the front end started a new session, in a new odom frame.
  void clear();

  /// True when a keyframe stands farther from where the map has it than the configuration allows.
  [[nodiscard]] bool needs_rebuild() const;

  [[nodiscard]] RebuildJob begin_rebuild();
  void finish_rebuild(ThreeLevelMap map);
  [[nodiscard]] bool rebuilding() const { return rebuilding_; }

  [[nodiscard]] const ThreeLevelMap& voxels() const { return map_; }
  [[nodiscard]] const KeyframeClouds& clouds() const { return clouds_; }
  [[nodiscard]] const Pose& T_map_odom() const { return T_map_odom_; }
  [[nodiscard]] std::int32_t revision() const { return revision_; }  ///< that the voxels stand on
  [[nodiscard]] Pose T_map_body() const { return T_map_odom_ * T_odom_body_; }
  [[nodiscard]] int rebuilds() const { return rebuilds_; }
  [[nodiscard]] std::int64_t refused_poses() const { return refused_poses_; }

  [[nodiscard]] std::vector<Eigen::Vector3f> odometry_path() const { return path_.odometry(); }
  [[nodiscard]] std::vector<Eigen::Vector3f> corrected_path() const;
  [[nodiscard]] std::vector<LoopEdge> loop_edges() const;
  /// Where the keyframes stand [m, map], ascending ids.
  [[nodiscard]] std::vector<std::pair<std::int32_t, Eigen::Vector3f>> keyframe_positions() const;
  /// The cloud of a keyframe at its corrected pose [m, map]; empty when it is not in store.
  [[nodiscard]] std::vector<Eigen::Vector3f> placed_cloud(std::int32_t id) const;

  /// Keyframe ids below `count` whose cloud never arrived.
  [[nodiscard]] std::vector<std::int32_t> missing_keyframes(std::int32_t count) const;

 private:
  struct Node {
    Pose T_odom_keyframe;
    Pose T_map_keyframe;  // newest
    Pose T_map_drawn;     // where the map has its points
    bool has_cloud = false;
    bool corrected = false;
  };
  struct WaitingScan {
    std::vector<CloudPoint> points;
    Pose T_odom_body;
  };

  [[nodiscard]] Pose T_map_odom_at(std::int32_t keyframe_id) const;
  [[nodiscard]] bool moved(const Pose& now, const Pose& drawn) const;

  MapConfig config_;
  ThreeLevelMap map_;
  KeyframeClouds clouds_;
  DrivenPath path_;
  std::map<std::int32_t, Node> nodes_;
  std::set<std::pair<std::int32_t, std::int32_t>> loops_;
  Pose T_map_odom_;
  Pose T_odom_body_;
  bool loop_is_new_ = false;
  bool corrected_since_loop_ = false;
  bool rebuilding_ = false;
  std::vector<WaitingScan> waiting_;  // arrived while a rebuild was running
  std::int32_t revision_ = 0;
  int rebuilds_ = 0;
  std::int64_t refused_poses_ = 0;
};

}  // namespace ignis
