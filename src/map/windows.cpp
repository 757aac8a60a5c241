// SPDX-License-Identifier: Apache-2.0
#include "map/windows.h"

#include <algorithm>
#include <cmath>

namespace ignis {

Box tile_box(const CellIndex& tile, double tile_m) {
  const Eigen::Vector3d min = tile_m * Eigen::Vector3d(tile.x, tile.y, tile.z);
  return {min, min + Eigen::Vector3d::Constant(tile_m)};
}

bool Windows::contains(double radius, const Eigen::Vector3d& p_world) const {
  const Eigen::Vector3d offset = p_world - centre;
  return std::abs(offset.y()) <= height_m && radius >= 0.0 &&
         offset.x() * offset.x() + offset.z() * offset.z() <= radius * radius;
}

Reach Windows::reach(double radius, const Box& box) const {
  if (radius < 0.0) return Reach::kOutside;
  const auto nearest = [](double p, double min, double max) { return std::max({min - p, p - max, 0.0}); };
  const auto farthest = [](double p, double min, double max) { return std::max(std::abs(p - min), std::abs(p - max)); };
  const auto horizontal = [&](const auto& along) {
    return std::hypot(along(centre.x(), box.min.x(), box.max.x()), along(centre.z(), box.min.z(), box.max.z()));
  };
  if (nearest(centre.y(), box.min.y(), box.max.y()) > height_m || horizontal(nearest) > radius) return Reach::kOutside;
  const bool all = farthest(centre.y(), box.min.y(), box.max.y()) <= height_m && horizontal(farthest) <= radius;
  return all ? Reach::kInside : Reach::kPartly;
}

}  // namespace ignis
