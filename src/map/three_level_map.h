// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/measurements.h"
#include "common/pose.h"
#include "map/map_config.h"
#include "map/map_picture.h"
#include "map/voxel_level.h"

namespace ignis {

/// A cloud and where it belongs. The points are shared: a rebuild reads them on another thread while nobody writes.
struct PlacedCloud {
  std::int32_t keyframe_id = kLive;
  std::shared_ptr<const std::vector<CloudPoint>> points;  ///< body frame of the keyframe
  Pose T_world_body;
};

/// A voxel as a viewer gets it.
struct ViewVoxel {
  CellIndex cell;
  std::uint8_t intensity = 0;
  bool live = true;  ///< from a live scan, not yet from a (corrected) keyframe
};

/// What one level shows inside a view radius. Heights are those of the points [m, world Y]; 0 when there is none.
struct LevelView {
  double cell_m = 0.0;
  CellIndex origin;  ///< the cell below the vehicle; all cells shown lie within 16 bits of it
  std::vector<ViewVoxel> voxels;
  double min_height = 0.0;
  double max_height = 0.0;
};

using MapView = std::array<LevelView, kLevels>;

/// What became of the points of one cloud.
struct InsertCounts {
  std::size_t inserted = 0;
  std::size_t outside = 0;   ///< beyond the coarse window or the height window
  std::size_t rejected = 0;  ///< not finite, or the pose is unusable, or no room is left
};

/// Voxel map in three resolutions around the vehicle; world frame, +Y up.
///
/// Each level holds what lies in its cylindrical window (horizontal distance and height from the vehicle). A point
/// enters the finest level whose window contains it, which for a scan within 10 m is the local level. When the vehicle
/// drives on, a voxel that leaves the window of its level enters the next one, where the point nearest the centre of
/// the larger cell stays; what leaves the coarse window or the height window is forgotten. The windows follow in steps
/// of `slide_step_m`, since a pass visits every voxel.
///
/// Memory: 33 bytes per slot of the hash tables, of which at most 7/8 are full, so `max_voxels` = 3,000,000 stays below
/// 250 MB even right after a table has doubled. Not thread-safe; no clocks, no files.
class ThreeLevelMap {
 public:
  explicit ThreeLevelMap(const MapConfig& config);

  /// Moves the windows to the pose and inserts the points.
  InsertCounts insert(std::span<const CloudPoint> points_body, const Pose& T_world_body,
                      std::int32_t keyframe_id = kLive);

  /// Forgets everything and builds all levels from these clouds, in their order, around the vehicle's pose.
  void replace_world(std::span<const PlacedCloud> clouds, const Pose& T_world_body);

  void clear();

  /// The local level in full; of the mid and coarse levels what lies within `radius_m` of the windows' centre and is
  /// not already shown by a voxel of a finer level.
  [[nodiscard]] MapView view(double radius_m) const;

  [[nodiscard]] const VoxelLevel& level(std::size_t index) const { return levels_[index]; }
  [[nodiscard]] const Eigen::Vector3d& centre() const { return centre_; }
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] std::size_t bytes() const;

  /// Times that a whole level was coarsened because the map had reached `max_voxels`.
  [[nodiscard]] int coarsened() const { return coarsened_; }

  /// Hash over all voxels: equal maps have equal fingerprints.
  [[nodiscard]] std::string fingerprint() const;

 private:
  void follow(const Eigen::Vector3d& p_world_vehicle);
  void slide_windows();
  [[nodiscard]] bool make_room(std::size_t points);
  [[nodiscard]] bool inside(std::size_t level, const Eigen::Vector3d& p_world) const;
  bool place(const MapPoint& point, std::size_t finest_level);
  InsertCounts place_all(std::span<const CloudPoint> points_body, const Pose& T_world_body, std::int32_t keyframe_id);

  MapConfig config_;
  std::array<double, kLevels> windows_;
  std::array<VoxelLevel, kLevels> levels_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  bool placed_ = false;
  int coarsened_ = 0;
};

/// False for poses that no map can hold: not finite, or farther from the origin than VoxelLevel::kMaxCoordinate.
[[nodiscard]] bool usable(const Pose& T_world_body);

}  // namespace ignis
