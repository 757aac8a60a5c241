// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "frontend/matching/scan_update.h"
#include "frontend/planes/plane_fit.h"

/// Structure that certainly faces along a direction about which the scan as a whole says little: the far end of a
/// corridor, the edge of a door frame.
///
/// A dozen points on an end wall pin a corridor's axis to a centimetre, yet among a thousand wall points whose normals
/// are off by a degree at random their share of the sum drowns. So once the sum has named a direction as blind (see
/// degeneracy.h), each plane is asked for itself: is its normal's component along the axis more than its own error can
/// make it? Where a corridor bends the axis is the way its own wall goes, not the vehicle's (blind_shifts_of_point).
/// After the per-point contributions of T. Tuna, J. Nubert, Y. Nava, S. Khattak, M. Hutter, "X-ICP:
/// Localizability-Aware LiDAR Registration for Robust Localization in Extreme Environments", IEEE T-RO 40, 2024; there
/// the bound is a fixed angle, here it is a multiple of the normal's sigma.
namespace ignis {

/// What salient points say along the directions that all points together leave open.
struct SalientPart {
  PoseInformation constraints;
  double mean_scan = 0.0;  ///< mean number of the scans that the planes were mapped by
};

/// Variance of one neighbour across its plane, without bias by the plane's own fit [m^2].
[[nodiscard]] double variance_across(const PlaneFit& plane);

/// Whether the plane faces along one of the unit `axes` beyond doubt. `pooled_variance` [m^2]: mean of
/// variance_across() over the planes of the scan. Four points that happen to lie well say little about their own noise,
/// so the error of the normal is that of both together. `sigmas`: the multiple of that error to exceed.
[[nodiscard]] bool is_salient(const PlaneFit& plane, std::span<const Eigen::Vector3d> axes, double pooled_variance,
                              double sigmas);

}  // namespace ignis
