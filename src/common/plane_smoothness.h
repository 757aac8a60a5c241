// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace ignis {

/// How much a plane counts in matching by itself, (0, 1], by the variance of the points that it was fitted to, across
/// it [m^2]: half where their standard deviation is `smooth_plane_m` [m]; all planes count 1 when that is 0.
///
/// Where an edge or a corner passes for a plane, the fit depends on where the query lies and from where its
/// surroundings were seen. That is the same in scan after scan, so it does not average out, and another on the next
/// visit.
[[nodiscard]] inline double plane_smoothness(double variance, double smooth_plane_m) {
  const double limit2 = smooth_plane_m * smooth_plane_m;
  return limit2 > 0.0 ? limit2 / (limit2 + variance) : 1.0;
}

}  // namespace ignis
