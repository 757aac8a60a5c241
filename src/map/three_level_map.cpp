// SPDX-License-Identifier: Apache-2.0
#include "map/three_level_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/config_check.h"
#include "common/fingerprint.h"

namespace ignis {
namespace {

// A quaternion this far from unit length is damage, not rounding.
constexpr double kMaxNormError = 1e-3;
// The windows move when the vehicle is this much of a step away from their centre: more than the half at which
// rounding would move them, so that a vehicle on the border does not drag them to and fro.
constexpr double kFollowRatio = 0.75;
constexpr int kStepsOfLevels = 2;  // coarsening takes the local and the mid level away first
constexpr double kNarrowing = 0.8;
// Half the diagonal of a block, and what rounding to float may add.
constexpr double kBlockRadius = 0.5 * std::numbers::sqrt3 * CloudBlock::kEdge + 1e-3;

const MapConfig& checked(const MapConfig& config) {
  config::require_valid(config, "map");
  return config;
}

std::array<double, kLevels> window_radii(const MapConfig& config, int coarsening) {
  std::array<double, kLevels> radii{config.local_window_m, config.mid_window_m, config.coarse_window_m};
  for (int i = 0; i < std::min(coarsening, kStepsOfLevels); ++i) radii[static_cast<std::size_t>(i)] = -1.0;
  for (int i = kStepsOfLevels; i < coarsening; ++i) radii[kLevels - 1] *= kNarrowing;
  return radii;
}

}  // namespace

bool usable(const Pose& T_world_body) {
  return T_world_body.all_finite() && std::abs(T_world_body.rotation.norm() - 1.0) < kMaxNormError &&
         is_within_reach(T_world_body.translation);
}

ThreeLevelMap::ThreeLevelMap(const MapConfig& config)
    : config_(checked(config)), grid_(tile_grid(config)), locator_(grid_) {
  windows_.radius_m = window_radii(config_, 0);
  windows_.height_m = config_.height_window_m;
}

template <class Visit>
void ThreeLevelMap::for_each_placed(const Pose& T_world_cloud, std::span<const CloudPoint> points,
                                    Visit&& visit) const {
  const Eigen::Matrix3d R = T_world_cloud.rotation.normalized().toRotationMatrix();
  for (const CloudPoint& point : points) {
    const Eigen::Vector3d p_world = R * point.position.cast<double>() + T_world_cloud.translation;
    if (!is_within_reach(p_world)) continue;
    visit(point, locator_.locate(p_world));
  }
}

void ThreeLevelMap::place_windows(const Eigen::Vector3d& centre) {
  windows_.centre = centre;
  placed_ = true;
}

void ThreeLevelMap::follow(const Eigen::Vector3d& p_world_vehicle, const CloudLookup& clouds) {
  const double step = config_.slide_step_m;
  if (placed_ && (p_world_vehicle - windows_.centre).cwiseAbs().maxCoeff() <= kFollowRatio * step) return;
  place_windows(step * (p_world_vehicle / step).array().round().matrix());
  apply_windows(clouds);
}

LevelSet ThreeLevelMap::reached_levels(const CellIndex& tile) const {
  const Box box = tile_box(tile, grid_.tile_m());
  LevelSet levels = 0;
  for (std::size_t i = 0; i < kLevels; ++i) {
    if (windows_.reach(windows_.radius_m[i], box) != Reach::kOutside) levels |= only(i);
  }
  return levels;
}

void ThreeLevelMap::apply_windows(const CloudLookup& clouds) {
  std::vector<CellKey> entered;
  ++version_;
  for (auto& [key, tile] : tiles_) {
    const LevelSet levels = reached_levels(tile->index());
    if (levels == tile->held) continue;
    clear_levels(*tile, static_cast<LevelSet>(tile->held & ~levels));
    tile->refilling = static_cast<LevelSet>(levels & ~tile->held);
    if (tile->refilling != 0) entered.push_back(key);
    tile->held = levels;
    tile->touch(version_);
  }
  refill(entered, clouds);
  stay_within_bound(clouds);
}

void ThreeLevelMap::set_coarsening(int steps, const CloudLookup& clouds) {
  if (steps == coarsening_) return;
  coarsening_ = steps;
  windows_.radius_m = window_radii(config_, coarsening_);
  apply_windows(clouds);
}

void ThreeLevelMap::stay_within_bound(const CloudLookup& clouds) {
  if (size() > static_cast<std::size_t>(config_.max_voxels)) set_coarsening(coarsening_ + 1, clouds);
}

Tile& ThreeLevelMap::tile_of(CellKey key, const CellIndex& index) {
  std::unique_ptr<Tile>& tile = tiles_[key];
  if (!tile) {
    tile = std::make_unique<Tile>(index);
    tile->held = reached_levels(index);
  }
  return *tile;
}

void ThreeLevelMap::enter(Tile& tile, const Location& location, LevelSet levels, float intensity, std::int32_t id) {
  if (is_carved(tile, location)) return;
  for (std::size_t i = 0; i < kLevels; ++i) {
    if (!has(levels, i)) continue;
    const Voxel voxel{locator_.from_centre(i, location), intensity, id};
    if (tile.insert(i, locator_.cell_in_tile(i, location), voxel, version_)) ++sizes_[i];
  }
}

void ThreeLevelMap::clear_levels(Tile& tile, LevelSet levels) {
  for (std::size_t i = 0; i < kLevels; ++i) {
    if (has(levels, i)) sizes_[i] -= tile.clear(only(i));
  }
}

void ThreeLevelMap::add_cloud(std::int32_t id, const Pose& T_world_cloud) {
  clouds_[id] = {.T_world_cloud = T_world_cloud, .tiles = {}};
  if (!placed_) place_windows(T_world_cloud.translation);
}

InsertCounts ThreeLevelMap::insert(std::int32_t id, std::span<const CloudPoint> points_cloud) {
  Cloud& cloud = clouds_.at(id);
  InsertCounts counts;
  ++version_;
  Tile* tile = nullptr;  // neighbours in a cloud are neighbours in the world
  for_each_placed(cloud.T_world_cloud, points_cloud, [&](const CloudPoint& point, const Location& location) {
    if (tile == nullptr || tile->index() != location.tile) {
      const CellKey key = pack(location.tile);
      tile = &tile_of(key, location.tile);
      const bool is_newest = !tile->clouds.empty() && tile->clouds.back() == id;
      if (!is_newest && std::ranges::find(tile->clouds, id) == tile->clouds.end()) {
        tile->clouds.push_back(id);
        cloud.tiles.push_back(key);
      }
    }
    enter(*tile, location, tile->held, point.intensity, id);
    ++(tile->held != 0 ? counts.inserted : counts.outside);
  });
  counts.rejected = points_cloud.size() - counts.inserted - counts.outside;
  return counts;
}

bool ThreeLevelMap::is_carved(const Tile& tile, const Location& location) const {
  return !tile.votes.empty() && tile.votes[locator_.cell_in_tile(1, location)] >= config_.carve_keyframes;
}

/// Adds or takes back a cloud's votes; lists the tiles in which a cell is carved now and was not, or the reverse.
void ThreeLevelMap::count_votes(const Cloud& cloud, std::span<const FreeCell> free, int sign,
                                std::vector<CellKey>& changed) {
  const auto threshold = static_cast<std::uint16_t>(config_.carve_keyframes - (sign < 0 ? 1 : 0));
  const auto cells = static_cast<std::size_t>(grid_.cells_per_tile[1]);
  Tile* tile = nullptr;
  for (const FreeCell cell : free) {
    const Eigen::Vector3d p_world = cloud.T_world_cloud * grid_.centre_of(1, unpack_free_cell(cell));
    if (!is_within_reach(p_world)) continue;
    const Location location = locator_.locate(p_world);
    if (tile == nullptr || tile->index() != location.tile) tile = &tile_of(pack(location.tile), location.tile);
    if (tile->votes.empty()) tile->votes.resize(cells * cells * cells);
    std::uint16_t& votes = tile->votes[locator_.cell_in_tile(1, location)];
    votes = static_cast<std::uint16_t>(votes + sign);
    const CellKey key = pack(location.tile);
    if (votes == threshold && !tile->clouds.empty() && (changed.empty() || changed.back() != key)) {
      changed.push_back(key);
    }
  }
}

void ThreeLevelMap::cast_votes(std::int32_t id, const CloudLookup& clouds) {
  Cloud& cloud = clouds_.at(id);
  if (cloud.has_voted) return;
  cloud.has_voted = true;
  std::vector<CellKey> changed;
  count_votes(cloud, clouds(id).free, +1, changed);
  refill_all_levels(changed, clouds);
}

void ThreeLevelMap::leave_tiles(std::int32_t id, std::vector<CellKey>& left) {
  std::vector<CellKey>& tiles = clouds_.at(id).tiles;
  for (const CellKey key : tiles) std::erase(tiles_.at(key)->clouds, id);
  left.insert(left.end(), tiles.begin(), tiles.end());
  tiles.clear();
}

void ThreeLevelMap::move_clouds(std::span<const std::pair<std::int32_t, Pose>> moved, const CloudLookup& clouds) {
  std::vector<CellKey> touched;
  for (const auto& [id, T_world_cloud] : moved) {
    leave_tiles(id, touched);
    Cloud& cloud = clouds_.at(id);
    if (cloud.has_voted) count_votes(cloud, clouds(id).free, -1, touched);
    cloud.T_world_cloud = T_world_cloud;
    if (cloud.has_voted) count_votes(cloud, clouds(id).free, +1, touched);
    const Tile* newest = nullptr;
    for_each_placed(T_world_cloud, clouds(id).points, [&](const CloudPoint&, const Location& location) {
      if (newest != nullptr && newest->index() == location.tile) return;
      const CellKey key = pack(location.tile);
      Tile& tile = tile_of(key, location.tile);
      newest = &tile;
      if (std::ranges::find(tile.clouds, id) != tile.clouds.end()) return;
      tile.clouds.push_back(id);
      cloud.tiles.push_back(key);
    });
    touched.insert(touched.end(), cloud.tiles.begin(), cloud.tiles.end());
  }
  refill_all_levels(touched, clouds);
  stay_within_bound(clouds);
}

void ThreeLevelMap::remove_clouds(std::span<const std::int32_t> ids, const CloudLookup& clouds) {
  std::vector<CellKey> left;
  for (const std::int32_t id : ids) {
    leave_tiles(id, left);
    const Cloud& cloud = clouds_.at(id);
    if (cloud.has_voted) count_votes(cloud, clouds(id).free, -1, left);
    clouds_.erase(id);
  }
  refill_all_levels(left, clouds);
}

void ThreeLevelMap::refill_all_levels(std::vector<CellKey>& tiles, const CloudLookup& clouds) {
  std::ranges::sort(tiles);
  tiles.erase(std::ranges::unique(tiles).begin(), tiles.end());
  for (const CellKey key : tiles) tiles_.at(key)->refilling = tiles_.at(key)->held;
  refill(tiles, clouds);
}

/// Empties the levels that are marked in these tiles and offers them the points of all clouds that touch them.
void ThreeLevelMap::refill(const std::vector<CellKey>& tiles, const CloudLookup& clouds) {
  ++version_;
  std::vector<std::int32_t> ids;
  for (const CellKey key : tiles) {
    Tile& tile = *tiles_.at(key);
    clear_levels(tile, tile.refilling);
    tile.touch(version_);
    if (tile.refilling != 0) ids.insert(ids.end(), tile.clouds.begin(), tile.clouds.end());
  }
  std::ranges::sort(ids);
  ids.erase(std::ranges::unique(ids).begin(), ids.end());
  for (const std::int32_t id : ids) {
    const Pose& T_world_cloud = clouds_.at(id).T_world_cloud;
    const StoredCloud cloud = clouds(id);
    Tile* tile = nullptr;
    const auto offer = [&](std::span<const CloudPoint> points) {
      for_each_placed(T_world_cloud, points, [&](const CloudPoint& point, const Location& location) {
        if (tile == nullptr || tile->index() != location.tile) tile = tiles_.at(pack(location.tile)).get();
        if (tile->refilling != 0) enter(*tile, location, tile->refilling, point.intensity, id);
      });
    };
    if (cloud.blocks.empty()) offer(cloud.points);
    for (const CloudBlock& block : cloud.blocks) {
      if (!reaches_refilling_tile(T_world_cloud * Eigen::Vector3d(block.centre.cast<double>()), kBlockRadius)) continue;
      offer(cloud.points.subspan(block.begin, block.end - block.begin));
    }
  }
  for (const CellKey key : tiles) {
    Tile& tile = *tiles_.at(key);
    tile.refilling = 0;
    if (tile.clouds.empty() && tile.votes.empty()) tiles_.erase(key);
  }
}

bool ThreeLevelMap::reaches_refilling_tile(const Eigen::Vector3d& centre, double radius) const {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(radius);
  const Eigen::Vector3i first = cell_of<double>((centre - reach) / grid_.tile_m());
  const Eigen::Vector3i last = cell_of<double>((centre + reach) / grid_.tile_m());
  for (int x = first.x(); x <= last.x(); ++x) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int z = first.z(); z <= last.z(); ++z) {
        const auto tile = tiles_.find(pack({x, y, z}));
        if (tile != tiles_.end() && tile->second->refilling != 0) return true;
      }
    }
  }
  return false;
}

std::size_t ThreeLevelMap::cost_of_moving(std::span<const std::int32_t> ids, const CloudLookup& clouds) const {
  std::size_t cost = 0;
  std::vector<CellKey> tiles;
  for (const std::int32_t id : ids) {
    const std::vector<CellKey>& touched = clouds_.at(id).tiles;
    cost += clouds(id).points.size();
    tiles.insert(tiles.end(), touched.begin(), touched.end());
  }
  std::ranges::sort(tiles);
  tiles.erase(std::ranges::unique(tiles).begin(), tiles.end());
  for (const CellKey key : tiles) {
    const Tile& tile = *tiles_.at(key);
    if (tile.held == 0) continue;
    for (const std::int32_t id : tile.clouds) cost += clouds(id).points.size() / clouds_.at(id).tiles.size();
  }
  return cost;
}

void ThreeLevelMap::set_open_cloud(std::optional<std::int32_t> id) {
  if (id == open_) return;
  ++version_;
  for (const std::optional<std::int32_t>& changed : {open_, id}) {
    const auto found = changed ? clouds_.find(*changed) : clouds_.end();
    if (found == clouds_.end()) continue;
    for (const CellKey key : found->second.tiles) tiles_.at(key)->touch(version_);
  }
  open_ = id;
}

void ThreeLevelMap::continue_versions(const ThreeLevelMap& other) {
  for (auto& [key, tile] : tiles_) tile->touch(tile->version() + other.version_);
  version_ += other.version_;
}

std::vector<std::int32_t> ThreeLevelMap::cloud_ids() const {
  std::vector<std::int32_t> ids;
  for (const auto& [id, cloud] : clouds_) ids.push_back(id);
  return ids;
}

std::optional<MapPoint> ThreeLevelMap::find(std::size_t level, const CellIndex& cell) const {
  const Eigen::Vector3d centre = grid_.centre_of(level, cell);
  const CellIndex index = parent_cell(cell, grid_.cells_per_tile[level]);
  const auto tile = tiles_.find(pack(index));
  if (tile == tiles_.end() || !windows_.contains(windows_.radius_m[level], centre)) return std::nullopt;
  const Tile::Level& voxels = tile->second->level(level);
  const auto found = voxels.find(grid_.cell_in_tile(level, index, cell));
  if (found == voxels.end()) return std::nullopt;
  const Voxel& voxel = found->second;
  return MapPoint{centre + voxel.from_centre.cast<double>(), voxel.intensity, voxel.keyframe_id};
}

std::vector<std::pair<CellIndex, MapPoint>> ThreeLevelMap::sorted(std::size_t level) const {
  std::vector<std::pair<CellIndex, MapPoint>> voxels;
  for (const auto& [key, tile] : tiles_) {
    for (const auto& [number, voxel] : tile->level(level)) {
      const CellIndex cell = grid_.world_cell(level, tile->index(), number);
      const Eigen::Vector3d centre = grid_.centre_of(level, cell);
      if (!windows_.contains(windows_.radius_m[level], centre)) continue;
      voxels.emplace_back(cell,
                          MapPoint{centre + voxel.from_centre.cast<double>(), voxel.intensity, voxel.keyframe_id});
    }
  }
  std::ranges::sort(voxels, {}, [](const auto& entry) { return entry.first; });
  return voxels;
}

std::size_t ThreeLevelMap::bytes() const {
  std::size_t bytes = tiles_.bucket_count() * (sizeof(Tiles::value_type) + 1);
  for (const auto& [key, tile] : tiles_) bytes += tile->bytes();
  for (const auto& [id, cloud] : clouds_) bytes += sizeof(Cloud) + cloud.tiles.capacity() * sizeof(CellKey);
  return bytes;
}

std::string ThreeLevelMap::fingerprint() const {
  Fingerprint hash;
  for (std::size_t i = 0; i < kLevels; ++i) {
    const auto voxels = sorted(i);
    hash.add(static_cast<std::int64_t>(voxels.size()));
    for (const auto& [cell, point] : voxels) {
      for (const std::int64_t value : {cell.x, cell.y, cell.z, point.keyframe_id}) hash.add(value);
      for (const double value : point.p_world) hash.add(value);
      hash.add(static_cast<double>(point.intensity));
    }
  }
  return hash.text();
}

}  // namespace ignis
