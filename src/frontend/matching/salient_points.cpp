// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/salient_points.h"

#include <algorithm>
#include <cmath>

namespace ignis {
namespace {

// In a bare corridor what passes the test of the normal's error are fits over the edge between wall and ceiling: of few
// points, and thick.
constexpr int kFewestNeighbours = 6;
constexpr double kThickest = 0.2;          // scatter across over the largest one in the plane
constexpr double kSmallestCosine = 0.3;    // a plane that leans by less says too little to be worth the doubt
constexpr double kPooledNeighbours = 3.0;  // that the pooled variance counts for; a plane takes as many from its own

}  // namespace

double variance_across(const PlaneFit& plane) { return plane.count * plane.scatter[0] / std::max(plane.count - 3, 1); }

bool is_salient(const PlaneFit& plane, std::span<const Eigen::Vector3d> axes, double pooled_variance, double sigmas) {
  if (plane.count < kFewestNeighbours || plane.scatter[0] > kThickest * plane.scatter[2]) return false;
  const double own = variance_across(plane);
  const double both = (kPooledNeighbours * pooled_variance + plane.count * plane.scatter[0]) / plane.count;
  const double widened = own > 0.0 ? std::sqrt(both / own) : 0.0;
  return std::ranges::any_of(axes, [&](const Eigen::Vector3d& axis) {
    const double facing = std::abs(axis.dot(plane.normal));
    const double sigma = widened * (plane.normal_sigma.transpose() * axis).norm();
    return facing > kSmallestCosine && facing > sigmas * sigma;
  });
}

}  // namespace ignis
