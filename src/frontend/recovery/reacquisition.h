// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "frontend/filter/eskf.h"
#include "frontend/frontend_config.h"
#include "frontend/local_map/local_map.h"

namespace ignis {

/// Where matching begins after a stretch without corrections.
struct Reacquisition {
  Pose T_odom_body;
  /// Orthonormal axes (odom) along which this may be a place that only looks like the right one: nothing is known along
  /// them that was not known before.
  std::vector<Eigen::Vector3d> doubtful;
  std::string doubt;  ///< why, in words; empty without
};

/// For a start in motion, whose map is a scan or two and does not tell one place from another.
///
/// The matcher looks for planes around the points themselves and cannot see a wall that the prediction has moved
/// farther away than its radius: it would settle on what happens to lie near, wrongly and with full confidence. Here
/// each point is paired with the plane at the nearest map point, however far within four sigma of the prediction; the
/// radius narrows from pass to pass down to the matcher's own (coarse to fine, as in the iterative closest point
/// method). The prediction's covariance takes part as a prior.
///
/// Returns the predicted pose where four sigma lie within the matcher's radius.
[[nodiscard]] Pose approached(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body,
                              const LocalMap& map, const FrontendConfig& config);

/// In an established map, after a stretch without corrections: what approached() leads to is one place of several, and
/// likely_places() finds the others. The one is taken that the points support most and the prediction does not speak
/// against. Aisles and doors repeat themselves: others that are nearly as good make the axis that leads to them
/// doubtful. All axes are where few points meet the map, or do not lie in its planes, or the place was not expected, or
/// may be farther than the search reaches.
///
/// Returns the predicted pose, without doubt, where four sigma lie within the matcher's radius, and where the
/// prediction's covariance is no number.
[[nodiscard]] Reacquisition reacquire(const FilterState& predicted, std::span<const Eigen::Vector3f> points_body,
                                      const LocalMap& map, const FrontendConfig& config);

}  // namespace ignis
