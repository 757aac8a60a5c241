// SPDX-License-Identifier: Apache-2.0
#include "frontend/planes/plane_fit.h"

#include <algorithm>
#include <cmath>

#include "frontend/planes/scatter_axes.h"

namespace ignis {
namespace {

constexpr double kFlat = 0.1;  // sine of the angle at which a plane is seen, below which its side is not clear

}  // namespace

PlaneFit fit_plane(const NeighbourMoments& moments, const FrontendConfig& config, double radius) {
  PlaneFit fit;
  if (moments.count < config.min_plane_points) return fit;

  const double inverse_weight = 1.0 / moments.weight;
  fit.offset = moments.sum * inverse_weight;
  const Eigen::Matrix3d scatter = moments.sum_outer * inverse_weight - fit.offset * fit.offset.transpose();
  const ScatterAxes axes = scatter_axes(scatter);
  const Eigen::Vector3d lambda = axes.values.cwiseMax(0.0);
  fit.normal = axes.vectors.col(0);
  fit.count = moments.count;
  fit.points = moments.weight;
  fit.scatter = lambda;
  fit.mean_scan = moments.scan_sum * inverse_weight;
  fit.view = moments.view_sum * inverse_weight;

  const double tangential = (fit.offset - fit.normal * fit.normal.dot(fit.offset)).norm();
  if (!(lambda[0] < config.max_curvature * lambda[2])) {
    fit.verdict = PlaneVerdict::kBlob;
  } else if (!(lambda[1] > config.min_spread * lambda[2] && std::sqrt(lambda[1]) >= config.min_plane_width_m)) {
    fit.verdict = PlaneVerdict::kLine;
  } else if (!(tangential <= config.max_centroid_offset * radius)) {
    fit.verdict = PlaneVerdict::kOneSided;
  } else if (!(std::sqrt(lambda[0]) <= config.max_surface_roughness)) {
    fit.verdict = PlaneVerdict::kRough;
  } else {
    fit.verdict = PlaneVerdict::kPlane;
    // Three degrees of freedom went into the plane itself.
    const double across = lambda[0] / std::max(moments.count - 3, 1);
    fit.normal_sigma.col(0) = std::sqrt(across / lambda[1]) * axes.vectors.col(1);
    fit.normal_sigma.col(1) = std::sqrt(across / lambda[2]) * axes.vectors.col(2);
  }
  return fit;
}

bool is_side_clear(const PlaneFit& plane, const Eigen::Vector3d& view) {
  return std::abs(plane.normal.dot(view)) > kFlat * view.norm();
}

bool is_seen_from_other_side(const PlaneFit& plane, const Eigen::Vector3d& view) {
  constexpr double kSure = 2.0;  // sigma of the normal
  // From the plane and not from the query point, which the thickness of a wall sets apart from it.
  const Eigen::Vector3d from_plane = view - plane.offset;
  const double now = plane.normal.dot(from_plane);
  const double then = plane.normal.dot(plane.view);
  if ((now > 0.0) == (then > 0.0)) return false;
  const double now_variance = (plane.normal_sigma.transpose() * from_plane).squaredNorm();
  return std::abs(then) > kFlat && now * now > kSure * kSure * now_variance;
}

}  // namespace ignis
