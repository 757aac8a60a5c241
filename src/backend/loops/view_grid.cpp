// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/view_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace ignis {

ViewGrid::ViewGrid(std::span<const CloudPoint> cloud, double cell_rad)
    : columns_(static_cast<std::size_t>(std::ceil(2.0 * std::numbers::pi / cell_rad))),
      rows_(static_cast<std::size_t>(std::ceil(std::numbers::pi / cell_rad))),
      nearest_(columns_ * rows_, std::numeric_limits<double>::infinity()) {
  for (const CloudPoint& point : cloud) {
    if (!point.position.allFinite()) continue;
    const Eigen::Vector3d p_body = point.position.cast<double>();
    double& nearest = nearest_[cell_of(p_body)];
    nearest = std::min(nearest, p_body.norm());
  }
}

bool ViewGrid::would_show(const Eigen::Vector3d& p_body, double margin_m) const {
  const double nearest = nearest_[cell_of(p_body)];
  return std::isfinite(nearest) && p_body.norm() <= nearest + margin_m;
}

std::size_t ViewGrid::cell_of(const Eigen::Vector3d& p_body) const {
  const double azimuth = std::atan2(p_body.x(), p_body.z()) + std::numbers::pi;
  const double elevation = std::atan2(p_body.y(), std::hypot(p_body.x(), p_body.z())) + 0.5 * std::numbers::pi;
  const auto cell = [](double angle, double span, std::size_t count) {
    return std::min(count - 1, static_cast<std::size_t>(angle / span * static_cast<double>(count)));
  };
  return cell(elevation, std::numbers::pi, rows_) * columns_ + cell(azimuth, 2.0 * std::numbers::pi, columns_);
}

}  // namespace ignis
