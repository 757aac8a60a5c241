// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "frontend/eskf.h"
#include "frontend/frontend_config.h"
#include "frontend/local_map.h"

namespace ignis {

/// Where matching begins after a stretch without corrections.
///
/// The matcher looks for planes around the points themselves and cannot see a wall that the prediction has moved
/// farther away than its radius: it would settle on what happens to lie near, wrongly and with full confidence. Here
/// each point is paired with the plane at the nearest map point, however far within four sigma of the prediction; the
/// radius narrows from pass to pass down to the matcher's own (coarse to fine, as in the iterative closest point
/// method). The prediction's covariance takes part as a prior.
///
/// Returns the pose to start from: the predicted one where four sigma lie within the matcher's radius.
[[nodiscard]] Pose reacquire(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body,
                             const LocalMap& map, const FrontendConfig& config);

}  // namespace ignis
