// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "frontend/frontend_config.h"

namespace ignis {

/// Sums over the neighbours of a query point, relative to that point: all that a plane fit needs, so that no list of
/// neighbours is ever built.
struct NeighbourMoments {
  int count = 0;
  double scan_sum = 0.0;                                ///< [scans] of the neighbours' mean scan numbers
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();        ///< [m] of (neighbour - query)
  Eigen::Matrix3d sum_outer = Eigen::Matrix3d::Zero();  ///< [m^2]

  /// One neighbour: the reference for LocalMap::gather, which sums rows of four voxels.
  void add(const Eigen::Vector3d& offset, double scan = 0.0) {
    ++count;
    scan_sum += scan;
    sum += offset;
    sum_outer += offset * offset.transpose();
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
  Eigen::Vector3d scatter = Eigen::Vector3d::Zero();  ///< [m^2] their variance across the plane and in it, ascending
  double mean_scan = 0.0;  ///< [scans] mean number of the scans that the neighbours come from
};

/// Principal component fit with the reference's gates: number, curvature, spread, one-sidedness, roughness.
///
/// `radius` [m] is the one that the neighbours were gathered in. One-sidedness is measured within the plane. The part
/// along the normal is the residual itself: counting it would throw away all planes as soon as the prediction is off by
/// more than the gate.
[[nodiscard]] PlaneFit fit_plane(const NeighbourMoments& moments, const FrontendConfig& config, double radius);
[[nodiscard]] inline PlaneFit fit_plane(const NeighbourMoments& moments, const FrontendConfig& config) {
  return fit_plane(moments, config, config.match_radius_m);
}

}  // namespace ignis
