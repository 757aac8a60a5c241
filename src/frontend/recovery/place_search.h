// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "frontend/filter/eskf.h"
#include "frontend/local_map/local_map.h"

namespace ignis {

/// Where a prediction that may be off by metres can have been meant: the shifts under which most points come to lie in
/// occupied cells of the map, at the predicted attitude, each weighed by how likely the prediction calls it.
///
/// Every cell within kPlaceSigmas and kFarthestPlace is tried, so that no local optimum can hide another one. After: E.
/// Olson, "Real-time correlative scan matching", ICRA 2009, in three dimensions.
///
/// At most `most` positions [m, odom], best first and apart from each other by more than kApart, a cell (0.2 m) within
/// the best near each. Points that are farther than kFarthestSearchPoint have no say. The covariance has to be finite.
[[nodiscard]] std::vector<Eigen::Vector3d> likely_places(const FilterState& predicted,
                                                         std::span<const Eigen::Vector3f> points_body,
                                                         const LocalMap& map, std::size_t most);

inline constexpr double kPlaceSigmas = 4.0;           ///< of the prediction: how far a place may be
inline constexpr double kFarthestPlace = 4.0;         ///< m, along an axis, from the prediction
inline constexpr double kFarthestSearchPoint = 20.0;  ///< m: beyond, a bit of attitude moves a point by a cell

/// Independent points that a scan amounts to: what the share of its points that fit is worth as a log-likelihood of a
/// place. Of 282 places after five seconds without scans in four scenes, 12 put 43 wrong ones first, 25 put 23, 40
/// put 18, 60 put 19, 100 put 23; 60 leaves fewer of the right ones in doubt than 40.
inline constexpr double kIndependentPoints = 60.0;

}  // namespace ignis
