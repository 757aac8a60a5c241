// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "frontend/planes/plane_fit.h"

/// Where an edge or a corner passes for a plane, the fit is off by what the query's place and the visible side of the
/// edge make it: alike in scan after scan, and for all points there. Many such planes say no more than one of them, and
/// next to smooth planes that hold the pose they say nothing but their error. Where nothing else faces a way, along a
/// corridor with its door frames, they are all there is.
namespace ignis {

/// Variance of a plane's neighbours across it [m^2] that the noise of the measured points, `range_noise_m` [m] each,
/// does not explain. Neighbours are means of points and weighted by their number, so that noise alone makes a variance
/// of (count - 3) / points of a point's own. Taken as if all noise went across the plane; where a ray is not along the
/// normal, less does.
[[nodiscard]] double unexplained_variance(const PlaneFit& plane, double range_noise_m);

/// What is left of a plane's smoothness, (0, 1], where smooth planes suffice: little of a rough one.
[[nodiscard]] double strict_smoothness(double smoothness);

/// How well the smooth planes of a scan hold shifts. Turns are not looked at.
///
/// It is asked of the weakest direction and not of the one that a plane faces: where little tells the way, as in a
/// door, all that there is stays as it is (docs/results/planes.md, "Edges that pass for planes").
class SmoothSupport {
 public:
  /// A plane with its unit normal. It amounts to `strict`, its strict smoothness.
  void add(const Eigen::Vector3d& normal, double strict) { planes_ += strict * normal * normal.transpose(); }

  /// From 0, where they hold some direction hardly at all, over 1/2, where they hold each like `enough` [planes, more
  /// than 0] that face it, to 1.
  [[nodiscard]] double sufficiency(double enough) const;

 private:
  Eigen::Matrix3d planes_ = Eigen::Matrix3d::Zero();  // sum of n n^T, by strict smoothness
};

}  // namespace ignis
