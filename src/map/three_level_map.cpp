// SPDX-License-Identifier: Apache-2.0
#include "map/three_level_map.h"

#include <algorithm>
#include <cmath>

#include <boost/unordered/unordered_flat_set.hpp>

#include "common/config_check.h"
#include "common/fingerprint.h"

namespace ignis {
namespace {

// A quaternion this far from unit length is damage, not rounding.
constexpr double kMaxNormError = 1e-3;

struct CellHash {
  std::size_t operator()(const CellIndex& cell) const {
    std::size_t seed = 0;
    boost::hash_combine(seed, cell.x);
    boost::hash_combine(seed, cell.y);
    boost::hash_combine(seed, cell.z);
    return seed;
  }
};
using CellSet = boost::unordered_flat_set<CellIndex, CellHash>;

double horizontal_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::hypot(a.x() - b.x(), a.z() - b.z());
}

const MapConfig& checked(const MapConfig& config) {
  config::require_valid(config, "map");
  return config;
}

int cell_ratio(const VoxelLevel& fine, const VoxelLevel& coarse) {
  return static_cast<int>(std::lround(coarse.cell_m() / fine.cell_m()));
}

}  // namespace

bool usable(const Pose& T_world_body) {
  return T_world_body.all_finite() && std::abs(T_world_body.rotation.norm() - 1.0) < kMaxNormError &&
         T_world_body.translation.cwiseAbs().maxCoeff() < VoxelLevel::kMaxCoordinate;
}

ThreeLevelMap::ThreeLevelMap(const MapConfig& config)
    : config_(checked(config)),
      windows_{config.local_window_m, config.mid_window_m, config.coarse_window_m},
      levels_{VoxelLevel(config.local_cell_m), VoxelLevel(config.mid_cell_m), VoxelLevel(config.coarse_cell_m)} {}

InsertCounts ThreeLevelMap::insert(std::span<const CloudPoint> points_body, const Pose& T_world_body,
                                   std::int32_t keyframe_id) {
  if (!usable(T_world_body)) return {.rejected = points_body.size()};
  follow(T_world_body.translation);
  if (!make_room(points_body.size())) return {.rejected = points_body.size()};
  return place_all(points_body, T_world_body, keyframe_id);
}

void ThreeLevelMap::replace_world(std::span<const PlacedCloud> clouds, const Pose& T_world_body) {
  clear();
  if (!usable(T_world_body)) return;
  centre_ = T_world_body.translation;
  placed_ = true;
  for (const PlacedCloud& cloud : clouds) {
    if (usable(cloud.T_world_body) && make_room(cloud.points->size())) {
      place_all(*cloud.points, cloud.T_world_body, cloud.keyframe_id);
    }
  }
}

void ThreeLevelMap::clear() {
  for (VoxelLevel& level : levels_) level.clear();
  placed_ = false;
}

InsertCounts ThreeLevelMap::place_all(std::span<const CloudPoint> points_body, const Pose& T_world_body,
                                      std::int32_t keyframe_id) {
  InsertCounts counts;
  const Eigen::Matrix3d R_world_body = T_world_body.rotation.normalized().toRotationMatrix();
  for (const CloudPoint& point : points_body) {
    const Eigen::Vector3d p_world = R_world_body * point.position.cast<double>() + T_world_body.translation;
    if (!p_world.allFinite()) {
      ++counts.rejected;
    } else if (place({p_world, point.intensity, keyframe_id}, 0)) {
      ++counts.inserted;
    } else {
      ++counts.outside;
    }
  }
  return counts;
}

bool ThreeLevelMap::inside(std::size_t level, const Eigen::Vector3d& p_world) const {
  return std::abs(p_world.y() - centre_.y()) <= config_.height_window_m &&
         horizontal_distance(p_world, centre_) <= windows_[level] &&
         p_world.cwiseAbs().maxCoeff() < VoxelLevel::kMaxCoordinate;
}

bool ThreeLevelMap::place(const MapPoint& point, std::size_t finest_level) {
  for (std::size_t i = finest_level; i < kLevels; ++i) {
    if (!inside(i, point.p_world)) continue;
    levels_[i].insert(point);
    return true;
  }
  return false;
}

void ThreeLevelMap::follow(const Eigen::Vector3d& p_world_vehicle) {
  if (placed_ && (p_world_vehicle - centre_).norm() < config_.slide_step_m) return;
  centre_ = p_world_vehicle;
  placed_ = true;
  slide_windows();
}

void ThreeLevelMap::slide_windows() {
  for (std::size_t i = 0; i < kLevels; ++i) {
    levels_[i].extract([&](const Eigen::Vector3d& p_world) { return !inside(i, p_world); },
                       [&](const MapPoint& point) { place(point, i + 1); });
  }
}

bool ThreeLevelMap::make_room(std::size_t points) {
  const auto limit = static_cast<std::size_t>(config_.max_voxels);
  for (std::size_t i = 0; i + 1 < kLevels && size() + points > limit; ++i) {
    levels_[i].extract([](const Eigen::Vector3d&) { return true; },
                       [&](const MapPoint& point) { place(point, i + 1); });
    ++coarsened_;
  }
  return size() + points <= limit;
}

MapView ThreeLevelMap::view(double radius_m) const {
  MapView view;
  CellSet covered;
  for (std::size_t i = 0; i < kLevels; ++i) {
    const VoxelLevel& level = levels_[i];
    const double radius = i == 0 ? windows_[0] : std::min(radius_m, windows_[i]);
    const int ratio = i + 1 < kLevels ? cell_ratio(level, levels_[i + 1]) : 1;
    CellSet covered_next;
    if (i + 1 < kLevels) {
      for (const CellIndex& cell : covered) covered_next.insert(parent_cell(cell, ratio));
    }
    LevelView& shown = view[i];
    shown.cell_m = level.cell_m();
    shown.origin = level.cell_of(centre_);
    level.for_each([&](const CellIndex& cell, const MapPoint& point) {
      if (horizontal_distance(point.p_world, centre_) > radius || covered.contains(cell)) return;
      const bool first = shown.voxels.empty();
      shown.min_height = first ? point.p_world.y() : std::min(shown.min_height, point.p_world.y());
      shown.max_height = first ? point.p_world.y() : std::max(shown.max_height, point.p_world.y());
      shown.voxels.push_back(
          {cell, static_cast<std::uint8_t>(std::clamp(point.intensity, 0.0F, 255.0F)), point.keyframe_id == kLive});
      if (i + 1 < kLevels) covered_next.insert(parent_cell(cell, ratio));
    });
    covered = std::move(covered_next);
  }
  return view;
}

std::size_t ThreeLevelMap::size() const { return levels_[0].size() + levels_[1].size() + levels_[2].size(); }

std::size_t ThreeLevelMap::bytes() const { return levels_[0].bytes() + levels_[1].bytes() + levels_[2].bytes(); }

std::string ThreeLevelMap::fingerprint() const {
  Fingerprint hash;
  for (const VoxelLevel& level : levels_) {
    hash.add(static_cast<std::int64_t>(level.size()));
    for (const auto& [cell, point] : level.sorted()) {
      for (const std::int64_t value : {cell.x, cell.y, cell.z, point.keyframe_id}) hash.add(value);
      for (const double value : point.p_world) hash.add(value);
      hash.add(static_cast<double>(point.intensity));
    }
  }
  return hash.text();
}

}  // namespace ignis
