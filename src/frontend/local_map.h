// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/pose.h"
#include "frontend/frontend_config.h"
#include "frontend/plane_fit.h"

namespace ignis {

/// The cloud that scans are matched against: one point per voxel, the one nearest the voxel's centre, in a window that
/// slides with the vehicle. Frame odom, metres.
///
/// Voxels live in blocks of 4x4x4 with one bit of occupancy each; blocks are found by open addressing. A neighbourhood
/// is a few blocks and a bit mask, so its cost does not depend on the size of the map.
///
/// Points of scans that contradicted the map enter unconfirmed: they hold their voxel, but have no vote in plane fits
/// until a scan that agreed puts a point of its own there.
class LocalMap {
 public:
  explicit LocalMap(const FrontendConfig& config);

  /// Registers body points at a pose.
  void insert(std::span<const Eigen::Vector3f> points_body, const Pose& T_odom_body, bool confirmed);

  /// Sums over the confirmed points within the match radius of a point.
  [[nodiscard]] NeighbourMoments gather(const Eigen::Vector3d& query) const;

  /// Drops what left the window, once the vehicle has moved a quarter of the window since the last time.
  void slide(const Eigen::Vector3d& position);

  void clear();

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  /// All points, confirmed or not, in a fixed order.
  [[nodiscard]] std::vector<Eigen::Vector3d> points() const;

 private:
  static constexpr int kEdge = 4;
  static constexpr int kVoxels = kEdge * kEdge * kEdge;

  struct Block {
    Eigen::Vector3i coordinate = Eigen::Vector3i::Zero();  ///< in units of block edges
    std::uint64_t occupied = 0;
    std::uint64_t confirmed = 0;
    float local[kVoxels][3];  ///< [m] relative to the block's corner
  };

  [[nodiscard]] const Block* find(const Eigen::Vector3i& coordinate) const;
  [[nodiscard]] Block& find_or_add(const Eigen::Vector3i& coordinate);
  void insert_point(const Eigen::Vector3d& point, bool confirmed);
  void rebuild_table(std::size_t capacity);
  [[nodiscard]] std::size_t slot_of(const Eigen::Vector3i& coordinate) const;

  double voxel_size_;
  double match_radius_;
  double window_;
  double window_y_;
  std::vector<Block> blocks_;
  std::vector<std::int32_t> table_;  ///< index into blocks_, -1 when free; power of two, at most half full
  int size_ = 0;
  bool has_slid_ = false;
  Eigen::Vector3d last_slide_ = Eigen::Vector3d::Zero();
};

}  // namespace ignis
