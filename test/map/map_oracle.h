// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "map/live_map.h"
#include "map/random_pictures.h"

/// The map and the view once more, straight from their definitions and without any of the map's code but the list of
/// clouds: slow, and obviously right.
namespace ignis::test {

struct OracleVoxel {
  Eigen::Vector3f from_centre;
  float intensity;
  std::int32_t keyframe_id;

  [[nodiscard]] auto rank() const {
    return std::tuple(from_centre.squaredNorm(), keyframe_id, from_centre.x(), from_centre.y(), from_centre.z(),
                      intensity);
  }
};
using OracleLevel = std::map<CellIndex, OracleVoxel>;

inline CellIndex floor_cell(const Eigen::Vector3d& p, double cell_m) {
  const auto axis = [&](double x) { return static_cast<std::int32_t>(std::floor(x / cell_m)); };
  return {axis(p.x()), axis(p.y()), axis(p.z())};
}

inline Eigen::Vector3d cell_centre(const CellIndex& cell, double cell_m) {
  return cell_m * Eigen::Vector3d(cell.x + 0.5, cell.y + 0.5, cell.z + 0.5);
}

inline double horizontal_distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::hypot(a.x() - b.x(), a.z() - b.z());
}

/// How many closed keyframes found each mid cell free.
inline std::map<CellIndex, int> oracle_votes(const RebuildJob& job) {
  std::map<CellIndex, int> votes;
  for (const PlacedCloud& cloud : job.clouds) {
    if (cloud.id == job.open_cloud) continue;
    for (const FreeCell free : cloud.cloud->free) {
      const Eigen::Vector3d centre = cell_centre(unpack_free_cell(free), job.config.mid_cell_m);
      ++votes[floor_cell(cloud.T_map_keyframe * centre, job.config.mid_cell_m)];
    }
  }
  return votes;
}

/// The levels that the clouds of a job make, by brute force. Cell sizes must be powers of two [m].
inline std::array<OracleLevel, kLevels> oracle_levels(const RebuildJob& job) {
  const double cells[] = {job.config.local_cell_m, job.config.mid_cell_m, job.config.coarse_cell_m};
  const double windows[] = {job.config.local_window_m, job.config.mid_window_m, job.config.coarse_window_m};
  std::array<OracleLevel, kLevels> levels;
  std::map<CellIndex, int> votes = oracle_votes(job);
  for (const PlacedCloud& cloud : job.clouds) {
    const Eigen::Matrix3d R = cloud.T_map_keyframe.rotation.normalized().toRotationMatrix();
    for (const CloudPoint& point : cloud.cloud->points) {
      const Eigen::Vector3d p = R * point.position.cast<double>() + cloud.T_map_keyframe.translation;
      if (votes[floor_cell(p, cells[1])] >= job.config.carve_keyframes) continue;
      for (std::size_t i = 0; i < kLevels; ++i) {
        const CellIndex cell = floor_cell(p, cells[i]);
        const Eigen::Vector3d centre = cell_centre(cell, cells[i]);
        if (horizontal_distance(centre, job.centre) > windows[i] ||
            std::abs(centre.y() - job.centre.y()) > job.config.height_window_m) {
          continue;
        }
        const OracleVoxel voxel{(p - centre).cast<float>(), point.intensity, cloud.id};
        const auto [found, is_new] = levels[i].try_emplace(cell, voxel);
        if (!is_new && voxel.rank() < found->second.rank()) found->second = voxel;
      }
    }
  }
  return levels;
}

/// What a viewer of this radius sees of them.
inline ViewTable oracle_view(const RebuildJob& job, double radius) {
  const std::array<OracleLevel, kLevels> levels = oracle_levels(job);
  const double cells[] = {job.config.local_cell_m, job.config.mid_cell_m, job.config.coarse_cell_m};
  ViewTable view;
  std::set<CellIndex> covered;
  for (std::size_t i = 0; i < kLevels; ++i) {
    std::set<CellIndex> shown = covered;
    for (const auto& [cell, voxel] : levels[i]) {
      const bool in_radius = i == 0 || horizontal_distance(cell_centre(cell, cells[i]), job.centre) <= radius;
      if (!in_radius || covered.contains(cell)) continue;
      view.voxels[{i, cell}] = {static_cast<std::uint8_t>(voxel.intensity), voxel.keyframe_id == job.open_cloud};
      shown.insert(cell);
    }
    covered.clear();
    if (i + 1 == kLevels) break;
    const int ratio = static_cast<int>(std::lround(cells[i + 1] / cells[i]));
    for (const CellIndex& cell : shown) covered.insert(parent_cell(cell, ratio));
  }
  return view;
}

/// The table of a picture, for comparison.
inline ViewTable table_of(const MapPicture& picture) {
  ViewTable view;
  for (const SharedTilePicture& tile : picture.tiles) {
    for (std::size_t i = 0; i < kLevels; ++i) {
      for (const std::uint64_t voxel : tile->voxels[i]) {
        view.voxels[{i, picture.grid.world_cell(i, tile->tile, TileVoxel::cell(voxel))}] = {TileVoxel::intensity(voxel),
                                                                                            TileVoxel::live(voxel)};
      }
    }
  }
  return view;
}

}  // namespace ignis::test
