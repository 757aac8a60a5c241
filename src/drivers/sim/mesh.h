// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "drivers/sim/solids.h"

namespace ignis::sim {

/// Triangles that share their corners. World frame, metres. A surface, not a solid: it is seen from both sides and has
/// no inside.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices = {};
  std::vector<std::array<std::uint32_t, 3>> triangles = {};  ///< indices of the corners, right-hand rule for the normal
  double reflectivity = 0.5;
};

/// Where the ray meets the plane of a triangle, ahead or behind; nothing when it runs along the plane or the triangle
/// has no area.
[[nodiscard]] std::optional<Hit> intersect_plane_of(const TriangleMesh& mesh, std::size_t triangle, const Ray& ray);

/// Distance from a point to the nearest point of a triangle [m]. Ericson, Real-Time Collision Detection, section 5.1.5.
[[nodiscard]] double distance_to(const TriangleMesh& mesh, std::size_t triangle, const Eigen::Vector3d& point);

}  // namespace ignis::sim
