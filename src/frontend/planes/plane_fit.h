// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "frontend/frontend_config.h"

namespace ignis {

/// A neighbour of a query point.
struct Neighbour {
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< [m] neighbour - query
  double weight = 1.0;                               ///< measured points that it is the mean of
  double scan = 0.0;                                 ///< mean number of the scans that these come from
  Eigen::Vector3d view = Eigen::Vector3d::Zero();    ///< mean unit vector to where they were seen from
};

/// Sums over the neighbours of a query point, relative to that point: all that a plane fit needs, so that no list of
/// neighbours is ever built. All but the count are weighted: a plane near the border of a voxel leaves a few stray
/// points beyond it, and with equal weights the mean of these few would pull the plane over the border.
struct NeighbourMoments {
  int count = 0;
  double weight = 0.0;
  double scan_sum = 0.0;  ///< [scans]
  Eigen::Vector3d view_sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();        ///< [m] of the offsets
  Eigen::Matrix3d sum_outer = Eigen::Matrix3d::Zero();  ///< [m^2]

  /// The reference for LocalMap::gather, which sums rows of four voxels.
  void add(const Neighbour& neighbour) {
    ++count;
    weight += neighbour.weight;
    scan_sum += neighbour.weight * neighbour.scan;
    view_sum += neighbour.weight * neighbour.view;
    sum += neighbour.weight * neighbour.offset;
    sum_outer += neighbour.weight * neighbour.offset * neighbour.offset.transpose();
  }
};

enum class PlaneVerdict { kPlane, kTooFewPoints, kBlob, kLine, kOneSided, kRough };

/// A plane near a query point.
struct PlaneFit {
  PlaneVerdict verdict = PlaneVerdict::kTooFewPoints;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit, sign arbitrary
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< [m] centroid of the neighbours minus the query point
  /// One sigma of the normal [rad], as the two vectors in the plane by which it may be off. From the neighbours'
  /// scatter: variance of the slope of a least-squares plane = scatter across / (count x spread along).
  Eigen::Matrix<double, 3, 2> normal_sigma = Eigen::Matrix<double, 3, 2>::Zero();
  int count = 0;                                      ///< neighbours
  double points = 0.0;                                ///< measured points that these are the means of
  Eigen::Vector3d scatter = Eigen::Vector3d::Zero();  ///< [m^2] their variance across the plane and in it, ascending
  double mean_scan = 0.0;  ///< [scans] mean number of the scans that the neighbours come from
  Eigen::Vector3d view =
      Eigen::Vector3d::Zero();  ///< mean unit vector from the neighbours to where they were seen from
};

/// Principal component fit with the reference's gates: number, curvature, spread, one-sidedness, roughness.
///
/// Spread also in metres: noise puts the points of a wall in two layers of voxels, and a few means from neighbouring
/// columns may lie within 2 to 3 cm of a line. Such a width is noise: the normal is 20 to 90 degrees off, and its own
/// scatter, small both ways, does not say so (docs/results/planes.md).
///
/// `radius` [m] is the one that the neighbours were gathered in. One-sidedness is measured within the plane. The part
/// along the normal is the residual itself: counting it would throw away all planes as soon as the prediction is off by
/// more than the gate.
[[nodiscard]] PlaneFit fit_plane(const NeighbourMoments& moments, const FrontendConfig& config, double radius);
[[nodiscard]] inline PlaneFit fit_plane(const NeighbourMoments& moments, const FrontendConfig& config) {
  return fit_plane(moments, config, config.match_radius_m);
}

/// The plane's normal, pointing to the side that the body is on. `view`: vector from the query point to the body [m].
[[nodiscard]] inline Eigen::Vector3d side_of(const PlaneFit& plane, const Eigen::Vector3d& view) {
  return plane.normal.dot(view) > 0.0 ? plane.normal : Eigen::Vector3d(-plane.normal);
}

/// False where the body sees the plane so flatly that the normal's error may decide on which side it is: a far floor.
[[nodiscard]] bool is_side_clear(const PlaneFit& plane, const Eigen::Vector3d& view);

/// True when the neighbours were seen from one side of their plane and the body is on the other: they are the far face
/// of a wall. `view`: vector from the query point to the body [m]. Where the normal's own error decides on which side
/// the body is, that says nothing; an angle is no measure of it: within a doorway the wall beside it is seen at a few
/// degrees, and its plane is known better.
[[nodiscard]] bool is_seen_from_other_side(const PlaneFit& plane, const Eigen::Vector3d& view);

}  // namespace ignis
