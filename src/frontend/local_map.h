// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/byte_codec.h"
#include "common/pose.h"
#include "frontend/frontend_config.h"
#include "frontend/plane_fit.h"

namespace ignis {

/// The cloud that scans are matched against: one point per voxel in a window that slides with the vehicle. Frame odom,
/// metres. The point is the one nearest the voxel's centre or, with map_average_points above 1, the mean of all that
/// fell into the voxel, the newest counting at least 1 / map_average_points: range noise averages out.
///
/// Voxels live in blocks of 4x4x4 with one bit of occupancy each; blocks are found by open addressing. A neighbourhood
/// is a few blocks and a bit mask, so its cost does not depend on the size of the map.
///
/// Points of scans that contradicted the map enter unconfirmed: they hold their voxel, but have no vote in plane fits
/// until a scan that agreed puts a point of its own there.
class LocalMap {
 public:
  explicit LocalMap(const FrontendConfig& config);

  /// Registers the body points of the next scan at a pose.
  void insert(std::span<const Eigen::Vector3f> points_body, const Pose& T_odom_body, bool confirmed);

  /// Sums over the confirmed points within a radius [m] of a point.
  [[nodiscard]] NeighbourMoments gather(const Eigen::Vector3d& query, double radius) const;
  /// The same for the match radius.
  [[nodiscard]] NeighbourMoments gather(const Eigen::Vector3d& query) const { return gather(query, match_radius_); }

  /// The confirmed point nearest a point, within a radius [m]. Costs what gather costs: for rare use.
  [[nodiscard]] std::optional<Eigen::Vector3d> nearest(const Eigen::Vector3d& query, double radius) const;

  /// Drops what left the window, once the vehicle has moved a quarter of the window since the last time.
  void slide(const Eigen::Vector3d& position);

  void clear();

  /// Scans inserted since the map was begun.
  [[nodiscard]] int scans() const { return scans_; }
  /// Points of these scans.
  [[nodiscard]] std::int64_t inserted_points() const { return inserted_points_; }
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
    float local[kVoxels][3];        ///< [m] relative to the block's corner
    float scan[kVoxels];            ///< mean number of the scans that the point comes from
    std::uint16_t weight[kVoxels];  ///< points in the mean
  };

  /// Calls visit(offset from the query [m], block, bit) for every confirmed point within a radius.
  void for_each_near(const Eigen::Vector3d& query, double radius, auto&& visit) const;
  [[nodiscard]] const Block* find(const Eigen::Vector3i& coordinate) const;
  [[nodiscard]] Block& find_or_add(const Eigen::Vector3i& coordinate);
  void insert_point(const Eigen::Vector3d& point, bool confirmed);
  [[nodiscard]] bool nearer_to_centre(const Eigen::Vector3f& point, const Eigen::Vector3f& stored,
                                      const Eigen::Vector3i& inside) const;
  void rebuild_table(std::size_t capacity);
  void fit_table();
  [[nodiscard]] std::size_t slot_of(const Eigen::Vector3i& coordinate) const;

  double voxel_size_;
  double match_radius_;
  double window_;
  double window_y_;
  int average_points_;
  std::vector<Block> blocks_;
  std::vector<std::int32_t> table_;  ///< index into blocks_, -1 when free; power of two, at most half full
  int size_ = 0;
  int scans_ = 0;
  std::int64_t inserted_points_ = 0;
  bool has_slid_ = false;
  Eigen::Vector3d last_slide_ = Eigen::Vector3d::Zero();

  /// Taken voxels alone, each in one go: there are many.
  friend void transfer(auto& io, FieldsOf<Block> auto& block) {
    io.matrix(block.coordinate);
    io.number(block.occupied);
    io.number(block.confirmed);
    for (std::uint64_t left = block.occupied; left != 0; left &= left - 1) {
      const int bit = std::countr_zero(left);
      auto& at = block.local[bit];
      Eigen::Matrix<float, 5, 1> voxel(at[0], at[1], at[2], block.scan[bit], block.weight[bit]);
      io.matrix(voxel);
      if constexpr (requires { block.weight[bit] = 0; }) {
        for (int axis = 0; axis < 3; ++axis) at[axis] = voxel[axis];
        block.scan[bit] = voxel[3];
        block.weight[bit] = static_cast<std::uint16_t>(voxel[4]);
      }
    }
  }

  friend void transfer(auto& io, FieldsOf<LocalMap> auto& map) {
    io.list(map.blocks_);
    io.number(map.size_);
    io.number(map.scans_);
    io.number(map.inserted_points_);
    io.number(map.has_slid_);
    io.matrix(map.last_slide_);
    if constexpr (requires { map.fit_table(); }) map.fit_table();
  }
};

}  // namespace ignis
