// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "frontend/plane_fit.h"

/// Where an edge or a corner passes for a plane, the fit is off by what the query's place and the visible side of the
/// edge make it: alike in scan after scan, and for all points there. Many such planes say no more than one of them, and
/// next to smooth planes that face the same way they say nothing but their error. Where nothing else faces a way, along
/// a corridor with its door frames, they are all there is.
namespace ignis {

/// Variance of a plane's neighbours across it [m^2] that the noise of the measured points, `range_noise_m` [m] each,
/// does not explain. Neighbours are means of points and weighted by their number, so that noise alone makes a variance
/// of (count - 3) / points of a point's own. Taken as if all noise went across the plane; where a ray is not along the
/// normal, less does.
[[nodiscard]] double unexplained_variance(const PlaneFit& plane, double range_noise_m);

/// What is left of a plane's smoothness, (0, 1], where smooth planes suffice: little of a rough one.
[[nodiscard]] double strict_smoothness(double smoothness);

/// How well smooth planes hold shifts along each direction. Turns are not looked at: a far rough plane that alone holds
/// one is heard less for a near smooth one that faces the same way.
class SmoothSupport {
 public:
  /// `enough` [planes]: where smooth planes amount to so many, a rough one counts in the middle between its smoothness
  /// and its strict one.
  explicit SmoothSupport(double enough) : enough_(enough) {}

  /// A plane with its unit normal. It amounts to its strict smoothness.
  void add(const Eigen::Vector3d& normal, double smoothness);

  /// No more planes come.
  void finish();

  /// The weight of a plane, from its smoothness where others hold nothing along its normal to its strict smoothness
  /// where they hold all.
  [[nodiscard]] double weight(const Eigen::Vector3d& normal, double smoothness) const;

 private:
  double enough_;
  Eigen::Matrix3d planes_ = Eigen::Matrix3d::Zero();      // sum of n n^T
  Eigen::Matrix3d directions_ = Eigen::Matrix3d::Zero();  // its unit eigenvectors, as columns
  Eigen::Vector3d held_ = Eigen::Vector3d::Zero();        // [planes] along each
};

}  // namespace ignis
