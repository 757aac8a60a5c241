// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/byte_codec.h"
#include "common/measurements.h"
#include "common/pose.h"
#include "frontend/frontend_config.h"
#include "frontend/planes/plane_fit.h"

namespace ignis {

/// The cloud that scans are matched against: one point per voxel in a window that slides with the vehicle. Frame odom,
/// metres. The point is the one nearest the voxel's centre, with weight 1, or, with map_average_points above 1, the
/// mean of all that fell into the voxel, with their number as its weight and the newest counting at least 1 /
/// map_average_points: range noise averages out. Each remembers from where it was seen: a thin wall has two sides. With
/// map_two_faces a voxel has room for two points: what is seen from where the first one was not goes to the second, so
/// that the two faces of a wall within one voxel do not meet in the middle.
///
/// Voxels live in blocks of 4x4x4, blocks in regions of 4x4x4, with one bit of occupancy each; regions are found by
/// open addressing. A neighbourhood is one or two regions, bit masks, and the rows of four voxels that these leave, two
/// lines of the cache each: its cost does not depend on the size of the map, and empty space costs nothing.
///
/// Points of scans that contradicted the map enter unconfirmed: they hold their voxel, but have no vote in plane fits
/// until a scan that agreed puts a point of its own there, or with two faces one that saw it from there.
class LocalMap {
 public:
  explicit LocalMap(const FrontendConfig& config);

  /// Registers the body points of the next scan at a pose.
  void insert(std::span<const Eigen::Vector3f> points_body, const Pose& T_odom_body, bool confirmed);
  void insert(std::span<const CloudPoint> cloud_body, const Pose& T_odom_body, bool confirmed);

  /// Sums over the confirmed points within a radius [m] of a point that were seen from the side of a plane that `side`
  /// points to; zero: from any.
  [[nodiscard]] NeighbourMoments gather(const Eigen::Vector3d& query, double radius,
                                        const Eigen::Vector3d& side = Eigen::Vector3d::Zero()) const;
  /// The same for the match radius.
  [[nodiscard]] NeighbourMoments gather(const Eigen::Vector3d& query) const { return gather(query, match_radius_); }

  /// The confirmed point nearest a point, within a radius [m]. Costs what gather costs: for rare use.
  [[nodiscard]] std::optional<Eigen::Vector3d> nearest(const Eigen::Vector3d& query, double radius) const;

  /// The confirmed point (odom, [m]) of the voxel that a point lies in, as seen from the side of a plane that `side`
  /// points to, zero: from any; nothing where there is none, or fewer measured points are in its mean than
  /// `min_points`.
  [[nodiscard]] std::optional<Eigen::Vector3d> own_voxel(const Eigen::Vector3d& query, float min_points,
                                                         const Eigen::Vector3d& side) const;

  /// Calls of slide() that it takes to look through the map, so that no scan has to wait for all of it.
  static constexpr int kSlidesToSweep = 16;

  /// Once the vehicle has moved a quarter of the window since the last time, drops what left it, in the course of this
  /// and the next kSlidesToSweep - 1 calls: call it after each scan. What lies farther than map_window_m and is of
  /// scans before number `sure_since` goes as well: it is no longer where the map says, and a vehicle that comes back
  /// would be matched with both.
  void slide(const Eigen::Vector3d& position, int sure_since);

  void clear();

  /// Scans inserted since the map was begun.
  [[nodiscard]] int scans() const { return scans_; }
  /// Points of these scans.
  [[nodiscard]] std::int64_t inserted_points() const { return inserted_points_; }
  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  /// The confirmed points in the blocks that a box [m, odom] meets. Walks over all blocks: for rare use.
  [[nodiscard]] std::vector<Eigen::Vector3d> confirmed_near(const Eigen::Vector3d& lo, const Eigen::Vector3d& hi) const;
  /// All points, confirmed or not, in a fixed order.
  [[nodiscard]] std::vector<Eigen::Vector3d> points() const;

 private:
  static constexpr int kEdge = 4;
  static constexpr int kCells = kEdge * kEdge * kEdge;
  static constexpr int kFaces = 2;  ///< points that a voxel has room for, in blocks of their own

  /// Four voxels along x, each number ready for a vector register: two lines of the cache.
  struct alignas(128) Row {
    float x[kEdge] = {};  ///< [m] relative to the block's corner
    float y[kEdge] = {};
    float z[kEdge] = {};
    float weight[kEdge] = {};  ///< points in the mean
    float scan[kEdge] = {};    ///< mean number of the scans that these come from
    float view_x[kEdge] = {};  ///< mean unit vector from them to the body, for the sensor is near it
    float view_y[kEdge] = {};
    float view_z[kEdge] = {};
  };

  /// What a row holds of one voxel.
  struct Voxel {
    Eigen::Vector3f point = Eigen::Vector3f::Zero();  ///< [m] relative to the block's corner
    float weight = 0.0F;
    float scan = 0.0F;
    Eigen::Vector3f view = Eigen::Vector3f::Zero();
  };

  struct Block {
    Row rows[kCells / kEdge];
    Eigen::Vector3i coordinate = Eigen::Vector3i::Zero();  ///< in units of block edges
    std::uint32_t face = 0;                                ///< which of its voxels' points
    std::uint64_t occupied = 0;
    std::uint64_t confirmed = 0;
    float oldest = 0.0F;  ///< no voxel has a smaller `scan`: these only grow

    [[nodiscard]] Eigen::Vector3f point(int bit) const;  ///< [m] relative to the block's corner
    [[nodiscard]] Voxel voxel(int bit) const;
    void set_voxel(int bit, const Voxel& voxel);
  };

  /// Where a point goes.
  struct Place {
    Eigen::Vector3f local;  ///< [m] relative to the block's corner
    Eigen::Vector3f view;   ///< unit vector to the body
    std::int32_t block;     ///< index into blocks_, of the first face
    int bit;                ///< voxel within the block
  };

  struct Region {
    Eigen::Vector3i coordinate = Eigen::Vector3i::Zero();  ///< in units of region edges
    std::uint64_t present[kFaces] = {};                    ///< blocks that exist
    std::int32_t blocks[kFaces][kCells] = {};              ///< index into blocks_

    [[nodiscard]] bool has(std::uint32_t face, int bit) const { return (present[face] >> bit & 1U) != 0; }
    void put(std::uint32_t face, int bit, std::size_t block) {
      present[face] |= std::uint64_t{1} << bit;
      blocks[face][bit] = static_cast<std::int32_t>(block);
    }
  };

  /// Where a block is found: bit `bit` of `region`.
  struct Home {
    Region* region;
    int bit;
  };

  /// Voxels from corner to corner, both included.
  struct Box {
    Eigen::Vector3i lo;
    Eigen::Vector3i hi;
  };

  [[nodiscard]] Box box_around(const Eigen::Vector3d& query, double radius) const;
  [[nodiscard]] Eigen::Vector3f relative_to(const Block& block, const Eigen::Vector3d& query) const;
  /// Calls visit(block) for every block that a box meets.
  void for_each_block(const Box& box, auto&& visit) const;
  /// Calls visit(row, lanes) for every row of a block with confirmed points in the box; bit k of `lanes` says that
  /// voxel k of the row is one of them.
  static void for_each_row(const Block& block, const Box& box, auto&& visit);
  [[nodiscard]] const Region* find_region(const Eigen::Vector3i& coordinate) const;
  [[nodiscard]] Region& find_or_add_region(const Eigen::Vector3i& coordinate);
  /// Index into blocks_.
  [[nodiscard]] std::int32_t find_or_add_block(const Eigen::Vector3i& coordinate, std::uint32_t face);
  void insert_all(auto points, const Pose& T_odom_body, bool confirmed, auto position_of);
  /// Index into blocks_ of the one whose point of the place's voxel was seen from the same side, else of the first
  /// that has none, else of the second one.
  [[nodiscard]] std::int32_t block_of_face(const Place& place);
  void insert_point(const Place& place, bool confirmed);
  void sweep(std::uint64_t blocks);
  void prune(Block& block);
  void drop_block(std::size_t index);
  void drop_empty_regions();
  [[nodiscard]] bool nearer_to_centre(const Eigen::Vector3f& point, const Eigen::Vector3f& stored, int bit) const;
  [[nodiscard]] Home home_of(const Block& block);
  void rebuild_regions();
  void rebuild_table(std::size_t capacity);
  [[nodiscard]] std::size_t slot_of(const Eigen::Vector3i& coordinate) const;

  friend class NeighbourSearch;

  double voxel_size_;
  double match_radius_;
  double window_;
  double window_y_;
  double memory_;  ///< [m] like window_, for points of whose place the map is sure; never less
  float average_points_;
  bool two_faces_;
  std::vector<Block> blocks_;
  std::vector<Region> regions_;
  std::size_t newest_region_ = 0;    ///< index into regions_ of the one that was asked for last
  std::vector<std::int32_t> table_;  ///< index into regions_, -1 when free; power of two, at most half full
  int size_ = 0;
  int scans_ = 0;
  std::int64_t inserted_points_ = 0;
  bool has_slid_ = false;
  Eigen::Vector3d last_slide_ = Eigen::Vector3d::Zero();  ///< where the window was put last
  int sure_since_ = 0;                                    ///< what is of earlier scans has no place beyond the window
  std::uint64_t unswept_ = 0;                             ///< the first blocks, not looked at since
  std::uint64_t sweep_step_ = 0;                          ///< so many of them are looked at per scan

  /// Taken voxels alone, each in one go: there are many.
  friend void transfer(auto& io, FieldsOf<Block> auto& block) {
    io.matrix(block.coordinate);
    io.number_below(block.face, kFaces);
    io.number(block.occupied);
    io.number(block.confirmed);
    for (std::uint64_t left = block.occupied; left != 0; left &= left - 1) {
      const int bit = std::countr_zero(left);
      const Voxel voxel = block.voxel(bit);
      Eigen::Matrix<float, 8, 1> numbers;
      numbers << voxel.point, voxel.weight, voxel.scan, voxel.view;
      io.matrix(numbers);
      if constexpr (requires { block.set_voxel(bit, voxel); }) {
        block.set_voxel(bit, {numbers.head<3>(), numbers[3], numbers[4], numbers.tail<3>()});
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
    io.number(map.sure_since_);
    io.number(map.unswept_);
    io.number(map.sweep_step_);
    if constexpr (requires { map.rebuild_regions(); }) map.rebuild_regions();
  }
};

}  // namespace ignis
