// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "common/measurements.h"

namespace ignis {

/// Which way a cloud looks and how far: the nearest point of each cell of a grid of directions around the body's
/// origin. What lies in front of that point would have been seen; what lies behind it is hidden.
class ViewGrid {
 public:
  /// `cloud` in body axes; points that are not finite are left out; `cell_rad` is the side of a cell.
  ViewGrid(std::span<const CloudPoint> cloud, double cell_rad);

  /// A surface at `p_body` would have been seen: its direction was looked at, and nothing nearer than it by more than
  /// `margin_m` stands in the way.
  [[nodiscard]] bool would_show(const Eigen::Vector3d& p_body, double margin_m) const;

 private:
  [[nodiscard]] std::size_t cell_of(const Eigen::Vector3d& p_body) const;

  std::size_t columns_;
  std::size_t rows_;
  std::vector<double> nearest_;  ///< [m] per cell; infinite where nothing was seen
};

}  // namespace ignis
