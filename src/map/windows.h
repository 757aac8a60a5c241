// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

#include "map/tile_grid.h"

namespace ignis {

/// How much of a tile lies in a region.
enum class Reach : std::uint8_t { kOutside, kPartly, kInside };

/// An axis-parallel box [m, world].
struct Box {
  Eigen::Vector3d min;
  Eigen::Vector3d max;
};
[[nodiscard]] Box tile_box(const CellIndex& tile, double tile_m);

/// The cylindrical windows of the three levels about one centre: horizontal (XZ) radius per level, one height for all.
/// A cell belongs to a window when its centre does. A negative radius is a window that holds nothing.
struct Windows {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [m, world]
  std::array<double, kLevels> radius_m{};
  double height_m = 0.0;  ///< above and below the centre

  [[nodiscard]] bool contains(double radius, const Eigen::Vector3d& p_world) const;
  [[nodiscard]] Reach reach(double radius, const Box& box) const;
};

}  // namespace ignis
