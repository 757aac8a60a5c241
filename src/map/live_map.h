// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "common/keyframe.h"
#include "map/driven_path.h"
#include "map/keyframe_clouds.h"
#include "map/map_picture.h"
#include "map/three_level_map.h"

namespace ignis {

/// The corrected pose of one keyframe, frame map.
struct CorrectedPose {
  std::int32_t id = 0;
  Pose T_map_keyframe;
};

/// A cloud and where it belongs.
struct PlacedCloud {
  std::int32_t id = 0;
  SharedCloud cloud;
  Pose T_map_keyframe;
};

/// Everything that the map is a function of, shared or copied, so that it can be built on another thread.
struct RebuildJob {
  MapConfig config;
  std::vector<PlacedCloud> clouds;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the windows [m, map]
  int coarsening = 0;                                ///< at least
  std::optional<std::int32_t> open_cloud;
};

/// Builds the map of a job: the same voxels on any thread and after any history. `got_on` is called after each cloud.
[[nodiscard]] ThreeLevelMap rebuild(const RebuildJob& job, const std::function<void()>& got_on = {});

/// The voxel map of a drive. Frames: `odom` of the front end, `map` of the back end.
///
/// Invariant: the map equals rebuild(as_drawn()) at any time, voxel for voxel: scans enter it as the points that their
/// keyframe keeps, at the keyframe's pose; when the back end moves keyframes, what they leave and where they arrive is
/// filled from the clouds again, at once if that reads no more than `reanchor_points`. A larger correction is built
/// aside: begun (begin_rebuild), run anywhere (rebuild) and taken over (finish_rebuild). Meanwhile the map stays in use
/// as it is, and what arrives is added to both. Not thread-safe, no clocks.
class LiveMap {
 public:
  explicit LiveMap(const MapConfig& config);
  // The map asks this object for clouds.
  LiveMap(const LiveMap&) = delete;
  LiveMap& operator=(const LiveMap&) = delete;

  /// Draws nothing from here until the next rebuild, which then shows everything: for whoever looks at the end only.
  void draw_at_rebuild() { drawing_ = false; }

  /// A scan in the body frame. Returns what became of its points.
  InsertCounts insert_scan(std::span<const CloudPoint> points_body, const Pose& T_odom_body);

  /// A keyframe; known ids are ignored. False when its pose is unusable.
  bool add_keyframe(const Keyframe& keyframe);

  /// Whether a keyframe is of another drive although its session may be the same: a front end that starts anew counts
  /// from 0 again. Told by the stamps and places of the keyframes that the map has had.
  [[nodiscard]] bool is_of_another_drive(const Keyframe& keyframe) const;

  /// Which points of the newest scan or keyframe say something new. The same calls with these points alone make the
  /// same map, unless it carves: then every ray counts. Valid until the next call.
  [[nodiscard]] std::span<const std::uint32_t> newest_kept() const { return newest_kept_; }
  [[nodiscard]] bool follows_rays() const { return config_.carve_free_space; }

  /// The back end's newest state: poses that moved and the correction of odom. Poses that no map can hold are ignored
  /// and counted.
  void correct(const Pose& T_map_odom, std::span<const CorrectedPose> poses, std::int32_t revision = 0);

  void add_loop(std::int32_t from_id, std::int32_t to_id);
  void remove_loop(std::int32_t from_id, std::int32_t to_id);

  /// Forgets everything: the front end started a new session, in a new odom frame.
  void clear();

  /// True when more has moved, or has to go, than is worth doing at once.
  [[nodiscard]] bool needs_rebuild() const { return (moved_far_ || !leaving_.empty()) && !rebuilding_; }

  [[nodiscard]] RebuildJob begin_rebuild();
  void finish_rebuild(ThreeLevelMap map);
  [[nodiscard]] bool rebuilding() const { return rebuilding_; }

  /// What the map shows now: the clouds where it has them.
  [[nodiscard]] RebuildJob as_drawn() const;

  [[nodiscard]] const ThreeLevelMap& voxels() const { return map_; }
  [[nodiscard]] const KeyframeClouds& clouds() const { return clouds_; }
  [[nodiscard]] const Pose& T_map_odom() const { return T_map_odom_; }
  [[nodiscard]] Pose T_map_body() const { return T_map_odom_ * T_odom_body_; }
  [[nodiscard]] std::int32_t revision() const { return drawn_revision_; }  ///< that the voxels stand on
  [[nodiscard]] int rebuilds() const { return rebuilds_; }
  [[nodiscard]] std::int64_t reanchored() const { return reanchored_; }  ///< keyframes moved without a rebuild
  [[nodiscard]] std::int64_t refused_poses() const { return refused_poses_; }
  [[nodiscard]] std::int64_t refused_points() const { return refused_points_; }  ///< at poses that are sound

  [[nodiscard]] std::vector<Eigen::Vector3f> odometry_path() const { return path_.odometry(); }
  [[nodiscard]] std::vector<Eigen::Vector3f> corrected_path() const;
  [[nodiscard]] std::vector<LoopEdge> loop_edges() const;
  /// Where the keyframes stand [m, map], ascending ids.
  [[nodiscard]] std::vector<std::pair<std::int32_t, Eigen::Vector3f>> keyframe_positions() const;
  /// The cloud of a keyframe at its corrected pose [m, map]; empty when it is not in store.
  [[nodiscard]] std::vector<Eigen::Vector3f> placed_cloud(std::int32_t id) const;

  /// Whether a keyframe has been added; its cloud may have been dropped since.
  [[nodiscard]] bool has_come(std::int32_t id) const;

  /// Keyframe ids below `count` whose cloud never arrived and which `wanted` agrees to; the first `limit` of them.
  [[nodiscard]] std::vector<std::int32_t> missing_keyframes(std::int32_t count, std::size_t limit,
                                                            const std::function<bool(std::int32_t)>& wanted) const;

 private:
  struct Node {
    Utime utime = 0;
    Pose T_odom_keyframe;
    Pose T_map_keyframe;  // newest
    bool has_cloud = false;
    bool corrected = false;
  };
  struct Arrival {
    std::int32_t id;
    std::vector<CloudPoint> points;
  };

  [[nodiscard]] Pose T_map_odom_at(std::int32_t keyframe_id) const;
  [[nodiscard]] Pose newest_pose(std::int32_t cloud_id) const;
  [[nodiscard]] bool differs(const Pose& a, const Pose& b) const;
  [[nodiscard]] ThreeLevelMap::CloudLookup lookup() const;
  InsertCounts show(const KeyframeClouds::Kept& kept);
  void cast_votes();
  void drop_far_clouds();
  [[nodiscard]] bool is_for_a_rebuild(std::span<const std::int32_t> changed) const;
  void settle();

  MapConfig config_;
  ThreeLevelMap map_;
  KeyframeClouds clouds_;
  DrivenPath path_;
  std::map<std::int32_t, Node> nodes_;
  std::set<std::pair<std::int32_t, std::int32_t>> loops_;
  Pose T_map_odom_;
  Pose T_odom_body_;
  std::int32_t newest_revision_ = 0;
  std::int32_t drawn_revision_ = 0;
  std::int32_t rebuilt_revision_ = 0;  // that the rebuild under way will show
  bool drawing_ = true;
  bool moved_far_ = false;             // keyframes, so that only a rebuild brings the map to them
  std::vector<std::int32_t> leaving_;  // clouds beyond the bound, for the next rebuild to leave out
  bool rebuilding_ = false;
  std::span<const std::uint32_t> newest_kept_;
  std::vector<Arrival> arrivals_;  // since the rebuild under way began
  int rebuilds_ = 0;
  std::int64_t reanchored_ = 0;
  std::int64_t refused_poses_ = 0;
  std::int64_t refused_points_ = 0;
};

}  // namespace ignis
