// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <boost/unordered/unordered_flat_map.hpp>

#include "common/measurements.h"
#include "common/pose.h"
#include "map/map_config.h"
#include "map/stored_cloud.h"
#include "map/tile.h"
#include "map/windows.h"

namespace ignis {

/// What became of points that were offered.
struct InsertCounts {
  std::size_t inserted = 0;  ///< entered a level
  std::size_t known = 0;     ///< another point of the same keyframe stands for their place already
  std::size_t outside = 0;   ///< beyond all windows; kept in the clouds only
  std::size_t rejected = 0;  ///< not finite, beyond kMaxCoordinate, or the pose is unusable
};

/// Voxel map in three resolutions around the vehicle; world frame, +Y up.
///
/// The map is a pure function of the clouds that were added, their poses, the windows' centre and `coarsening`: every
/// point is offered to every level whose window reaches its place, and a cell keeps the point that stands_before all
/// others. So neither the order of points nor the history matters. Leaving a window is forgetting the voxels of that
/// level: the coarser ones hold the same place already, by the point nearest the centre of the larger cell. What comes
/// back into a window is filled from the clouds again, tile by tile, as are the tiles from which a cloud has moved
/// away.
///
/// The clouds themselves live elsewhere (KeyframeClouds); the map knows where they stand and which tiles they touch.
///
/// Memory: 25 bytes per slot of the hash tables, at most 7/8 and after growth 7/16 full, so 29 to 57 bytes per voxel;
/// `max_voxels` = 3,000,000 stays below 175 MB. Beside it 4 bytes per cloud and tile that it touches, twice.
/// Not thread-safe; no clocks, no files.
class ThreeLevelMap {
 public:
  /// What is stored of a cloud, in its body frame. Asked for clouds that were added and not removed.
  using CloudLookup = std::function<StoredCloud(std::int32_t id)>;

  explicit ThreeLevelMap(const MapConfig& config);

  /// Lets the windows follow the vehicle: in steps of `slide_step_m`, so that not every scan moves them.
  void follow(const Eigen::Vector3d& p_world_vehicle, const CloudLookup& clouds);

  /// Puts the windows exactly here; for a map without clouds.
  void place_windows(const Eigen::Vector3d& centre);

  /// A cloud that stands here; its points follow. `id` is new, the pose usable().
  void add_cloud(std::int32_t id, const Pose& T_world_cloud);
  InsertCounts insert(std::int32_t id, std::span<const CloudPoint> points_cloud);

  /// The cloud is closed, and what its rays found free counts from now on: a point lies in no level when
  /// `carve_keyframes` keyframes found its mid cell free. (None of them can be its own, which has hit the cell.)
  void cast_votes(std::int32_t id, const CloudLookup& clouds);
  [[nodiscard]] bool has_voted(std::int32_t id) const { return clouds_.at(id).has_voted; }

  /// Puts clouds elsewhere and fills what they leave and where they arrive.
  void move_clouds(std::span<const std::pair<std::int32_t, Pose>> moved, const CloudLookup& clouds);
  void remove_clouds(std::span<const std::int32_t> ids, const CloudLookup& clouds);

  /// Points that move_clouds would read, about.
  [[nodiscard]] std::size_t cost_of_moving(std::span<const std::int32_t> ids, const CloudLookup& clouds) const;

  /// The cloud whose voxels are shown as live.
  void set_open_cloud(std::optional<std::int32_t> id);

  /// Stamps of later changes will be larger than those of `other`, which this map replaces.
  void continue_versions(const ThreeLevelMap& other);

  [[nodiscard]] bool contains(std::int32_t id) const { return clouds_.contains(id); }
  [[nodiscard]] const Pose& pose(std::int32_t id) const { return clouds_.at(id).T_world_cloud; }
  [[nodiscard]] std::vector<std::int32_t> cloud_ids() const;
  [[nodiscard]] std::optional<std::int32_t> open_cloud() const { return open_; }

  [[nodiscard]] const TileGrid& grid() const { return grid_; }
  [[nodiscard]] const PointLocator& locator() const { return locator_; }
  [[nodiscard]] const Windows& windows() const { return windows_; }

  template <class Visit>
  void for_each_tile(Visit&& visit) const {
    for (const auto& [key, tile] : tiles_) visit(*tile);
  }

  /// The voxel of a cell, if the cell lies in its level's window.
  [[nodiscard]] std::optional<MapPoint> find(std::size_t level, const CellIndex& cell) const;

  /// All voxels inside a level's window in the order of their cells.
  [[nodiscard]] std::vector<std::pair<CellIndex, MapPoint>> sorted(std::size_t level) const;

  /// Voxels held of a level. Tiles on a window's rim count in full.
  [[nodiscard]] std::size_t size(std::size_t level) const { return sizes_[level]; }
  [[nodiscard]] std::size_t size() const { return sizes_[0] + sizes_[1] + sizes_[2]; }
  [[nodiscard]] std::size_t bytes() const;

  /// Steps by which `max_voxels` has coarsened the map: 1 without the local level, 2 without the mid one, from there on
  /// each makes the coarse window a fifth narrower.
  [[nodiscard]] int coarsening() const { return coarsening_; }
  void set_coarsening(int steps, const CloudLookup& clouds);
  /// Coarsens until the voxels are no more than `max_voxels`; insert() alone does not look.
  void stay_within_bound(const CloudLookup& clouds);

  /// Hash over all voxels inside the windows: equal maps have equal fingerprints.
  [[nodiscard]] std::string fingerprint() const;

 private:
  struct Cloud {
    Pose T_world_cloud;
    std::vector<CellKey> tiles;  // each once
    bool has_voted = false;
  };
  using Tiles = boost::unordered_flat_map<CellKey, std::unique_ptr<Tile>>;

  [[nodiscard]] LevelSet reached_levels(const CellIndex& tile) const;
  void apply_windows(const CloudLookup& clouds);
  Tile& tile_of(CellKey key, const CellIndex& index);
  void enter(Tile& tile, const Location& location, LevelSet levels, float intensity, std::int32_t id);
  [[nodiscard]] bool is_carved(const Tile& tile, const Location& location) const;
  void leave_tiles(std::int32_t id, std::vector<CellKey>& left);
  void count_votes(const Cloud& cloud, std::span<const FreeCell> free, int sign, std::vector<CellKey>& changed);
  void refill_all_levels(std::vector<CellKey>& tiles, const CloudLookup& clouds);
  void refill(const std::vector<CellKey>& tiles, const CloudLookup& clouds);
  void clear_levels(Tile& tile, LevelSet levels);
  [[nodiscard]] bool reaches_refilling_tile(const Eigen::Vector3d& centre, double radius) const;

  /// Calls visit(point, p_world, location) for the points of a cloud that the map can hold.
  template <class Visit>
  void for_each_placed(const Pose& T_world_cloud, std::span<const CloudPoint> points, Visit&& visit) const;

  MapConfig config_;
  TileGrid grid_;
  PointLocator locator_;
  Windows windows_;
  bool placed_ = false;
  Tiles tiles_;
  std::map<std::int32_t, Cloud> clouds_;
  std::optional<std::int32_t> open_;
  std::array<std::size_t, kLevels> sizes_{};
  std::uint64_t version_ = 0;
  int coarsening_ = 0;
};

/// False for poses that no map can hold: not finite, not a rotation, or farther from the origin than kMaxCoordinate.
[[nodiscard]] bool usable(const Pose& T_world_body);

}  // namespace ignis
