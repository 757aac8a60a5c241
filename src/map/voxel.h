// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <tuple>

#include <Eigen/Core>

namespace ignis {

/// The one point that stands for a cell.
struct Voxel {
  Eigen::Vector3f from_centre;  ///< [m] from the cell's centre: small, so that a float loses nothing anywhere
  float intensity = 0.0F;       ///< reflectivity 0..255
  std::int32_t keyframe_id = 0;
};

/// True when `a` stands for the cell rather than `b`: it is nearer the centre; of two equally near, the one of the
/// earlier keyframe; then the smaller coordinates and intensity. A total order, so what a cell holds does not depend on
/// the order in which its points came.
[[nodiscard]] inline bool stands_before(const Voxel& a, const Voxel& b) {
  const float distance_a = a.from_centre.squaredNorm();
  const float distance_b = b.from_centre.squaredNorm();
  if (distance_a != distance_b) return distance_a < distance_b;
  const auto rest = [](const Voxel& v) {
    return std::tuple(v.keyframe_id, v.from_centre.x(), v.from_centre.y(), v.from_centre.z(), v.intensity);
  };
  return rest(a) < rest(b);
}

/// A voxel's point where it is.
struct MapPoint {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();  ///< [m]
  float intensity = 0.0F;
  std::int32_t keyframe_id = 0;
};

}  // namespace ignis
