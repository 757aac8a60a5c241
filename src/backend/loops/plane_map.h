// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "backend/loops/voxel_index.h"
#include "common/measurements.h"
#include "common/pose.h"

namespace ignis {

/// A plane through `centre`, fitted to the neighbourhood of a voxel.
struct SurfacePlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit length, sign arbitrary
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double variance = 0.0;  ///< of the fitted points, across the plane [m^2]
};

/// When a neighbourhood counts as a plane.
struct PlaneGates {
  double thickness_m;  ///< largest standard deviation across the plane
  int min_points;      ///< fewest points
};

/// A cloud and where it stands in the frame of a map.
struct CloudInMap {
  std::span<const CloudPoint> points;
  Pose T_map_cloud;
};

/// The surfaces of some clouds in one frame: a grid of voxels that hold the first and second moments of their points.
/// It answers "which plane is near" with one or a few probes; planes are fitted once, when first asked for, and
/// answers depend on the points alone, not on the order of the questions. Not for use by several threads.
class PlaneMap {
 public:
  /// Points that are not finite are left out. A plane is fitted to a voxel and its 26 neighbours together;
  /// where these hold too few points, to the 125 voxels around.
  PlaneMap(std::span<const CloudInMap> clouds, double voxel_m, const PlaneGates& gates);

  /// The same points in larger voxels, each of which has a plane of its own points alone.
  [[nodiscard]] PlaneMap coarser(double voxel_m) const;

  /// The plane of the voxel that `point` lies in; where that is empty, of the neighbour whose centre of gravity is
  /// nearest. Nothing when that centre is not within `radius_m` or the surroundings are not planar.
  [[nodiscard]] std::optional<SurfacePlane> nearest_plane(const Eigen::Vector3d& point, double radius_m);

  /// That voxel has points within `radius_m`, on a plane or not.
  [[nodiscard]] bool has_points_near(const Eigen::Vector3d& point, double radius_m) const {
    return nearest_voxel(point, radius_m).has_value();
  }

  /// Occupied voxels, numbered from 0 in the order in which they were met.
  [[nodiscard]] std::size_t size() const { return voxels_.size(); }
  /// The first point that fell into the voxel.
  [[nodiscard]] const Eigen::Vector3d& first_point(std::size_t voxel) const { return contents_[voxel].first_point; }
  [[nodiscard]] std::optional<SurfacePlane> plane(std::size_t voxel);

 private:
  enum class Fit : std::uint8_t { kUnknown, kPlane, kNoPlane };

  /// Sums over points, coordinates of the map.
  struct Moments {
    double count = 0.0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();

    void operator+=(const Moments& other);
  };

  /// What a search looks at.
  struct Voxel {
    Eigen::Vector3d centre_of_gravity = Eigen::Vector3d::Zero();
    SurfacePlane plane;
    Fit fit = Fit::kUnknown;
  };

  /// What a plane is fitted to.
  struct Content {
    Moments moments;
    Eigen::Vector3d first_point;
    Eigen::Vector3i cell;
  };

  PlaneMap(double voxel_m, int fit_reach, const PlaneGates& gates);
  Moments& moments_at(const Eigen::Vector3d& point);
  void note_centres();
  [[nodiscard]] std::optional<std::size_t> nearest_voxel(const Eigen::Vector3d& point, double radius_m) const;
  void fit(std::size_t voxel);

  double voxel_m_;
  int fit_reach_;  ///< voxels on either side that belong to the neighbourhood of a plane
  PlaneGates gates_;
  std::vector<Voxel> voxels_;
  std::vector<Content> contents_;  ///< by voxel
  VoxelIndex index_;               ///< numbers of the voxels
};

/// The first finite point of each cubic voxel, in the order of the cloud.
[[nodiscard]] std::vector<CloudPoint> one_per_voxel(std::span<const CloudPoint> cloud, double voxel_m);

}  // namespace ignis
