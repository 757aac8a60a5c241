// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <boost/unordered/unordered_flat_map.hpp>

namespace ignis {

/// A plane through `centre`, fitted to the neighbourhood of a map point.
struct SurfacePlane {
  Eigen::Vector3d normal;  ///< unit length, sign arbitrary
  Eigen::Vector3d centre;
};

/// When a neighbourhood counts as a plane.
struct PlaneGates {
  double radius_m;     ///< neighbours are looked for this far
  double thickness_m;  ///< largest standard deviation across the plane
  int min_points;      ///< fewest neighbours
};

/// A static point map in one frame that answers "which plane is nearest". Planes are fitted once, when first asked for;
/// answers depend on the points alone, not on the order of the questions. Not for use by several threads.
class PlaneMap {
 public:
  /// Keeps one point (the first) per voxel of `voxel_m`.
  PlaneMap(std::span<const Eigen::Vector3d> points, double voxel_m, const PlaneGates& gates);

  /// The plane at the map point nearest to `point`, if there is one within `radius_m` and its surroundings are planar.
  [[nodiscard]] std::optional<SurfacePlane> nearest_plane(const Eigen::Vector3d& point, double radius_m);

  /// There is a map point within `radius_m`, on a plane or not.
  [[nodiscard]] bool has_point_near(const Eigen::Vector3d& point, double radius_m) const {
    return nearest_point(point, radius_m).has_value();
  }

  [[nodiscard]] std::size_t size() const { return points_.size(); }

 private:
  enum class Fit : std::uint8_t { kUnknown, kPlane, kNoPlane };
  struct Entry {
    Fit fit = Fit::kUnknown;
    SurfacePlane plane;
  };

  /// Places in points_ of the points of one cell.
  struct Range {
    std::size_t begin = 0;
    std::size_t end = 0;
  };

  void sort_into_cells(std::span<const Eigen::Vector3d> points);
  [[nodiscard]] std::optional<std::size_t> nearest_point(const Eigen::Vector3d& point, double radius_m) const;
  [[nodiscard]] Entry fit_plane(const Eigen::Vector3d& at) const;
  [[nodiscard]] Range points_of(const Eigen::Vector3i& cell) const;

  PlaneGates gates_;
  std::vector<Eigen::Vector3d> points_;  ///< cell by cell
  std::vector<Entry> entries_;
  boost::unordered_flat_map<std::uint64_t, Range> cells_;
};

/// One point (the first) per cubic voxel, in the order of the input.
[[nodiscard]] std::vector<Eigen::Vector3d> one_per_voxel(std::span<const Eigen::Vector3d> points, double voxel_m);

}  // namespace ignis
