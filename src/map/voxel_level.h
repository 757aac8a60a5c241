// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <boost/unordered/unordered_flat_map.hpp>

#include "map/cell_index.h"

namespace ignis {

/// A map point that did not come from a keyframe but from a live scan.
inline constexpr std::int32_t kLive = -1;

/// The one point that stands for a cell.
struct MapPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< [m]
  float intensity = 0.0F;                             ///< reflectivity 0..255
  std::int32_t keyframe_id = kLive;
};

/// One level of the map: hashed cells with one point each, the point nearest the cell's centre. Which point that is
/// does not depend on the order of insertion, unless two are exactly equally near: then the earlier one stays.
/// Coordinates up to kMaxCoordinate are told apart; the caller refuses what lies beyond.
class VoxelLevel {
 public:
  static constexpr double kMaxCoordinate = 10'000.0;  ///< [m] 2^20 cells of 1 cm: the range of a packed index

  explicit VoxelLevel(double cell_m) : cell_m_(cell_m) {}

  /// Inserts a point; it stays if its cell was empty or it is nearer the centre than the cell's point.
  void insert(const MapPoint& point);

  /// Hands every point for which `leaves` is true to `receive`, and forgets it.
  void extract(const std::function<bool(const Eigen::Vector3d& p_world)>& leaves,
               const std::function<void(const MapPoint&)>& receive);

  void clear() { voxels_.clear(); }

  [[nodiscard]] CellIndex cell_of(const Eigen::Vector3d& p_world) const;
  [[nodiscard]] Eigen::Vector3d centre_of(const CellIndex& cell) const;
  [[nodiscard]] bool contains(const CellIndex& cell) const;
  [[nodiscard]] std::optional<MapPoint> find(const CellIndex& cell) const;

  /// Calls visit(cell, point) for every voxel, in no particular order.
  template <class Visit>
  void for_each(Visit&& visit) const {
    for (const auto& [key, voxel] : voxels_) {
      const CellIndex cell = unpack(key);
      visit(cell, to_point(cell, voxel));
    }
  }

  /// All voxels in the order of their cells: the same for equal levels, whatever their history.
  [[nodiscard]] std::vector<std::pair<CellIndex, MapPoint>> sorted() const;

  [[nodiscard]] double cell_m() const { return cell_m_; }
  [[nodiscard]] std::size_t size() const { return voxels_.size(); }

  /// Memory held by the hash table [bytes]: 32 per slot (8 index, 20 point, padding) and one byte of metadata.
  [[nodiscard]] std::size_t bytes() const;

 private:
  using Key = std::uint64_t;
  struct Voxel {
    Eigen::Vector3f from_centre;  // [m] small numbers, so that a float loses nothing far from the origin
    float intensity;
    std::int32_t keyframe_id;
  };

  [[nodiscard]] static Key pack(const CellIndex& cell);
  [[nodiscard]] static CellIndex unpack(Key key);
  [[nodiscard]] MapPoint to_point(const CellIndex& cell, const Voxel& voxel) const;

  double cell_m_;
  boost::unordered_flat_map<Key, Voxel> voxels_;
};

}  // namespace ignis
