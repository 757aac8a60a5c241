// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/mesh.h"

namespace ignis::sim {
namespace {

std::array<Eigen::Vector3d, 3> corners(const TriangleMesh& mesh, std::size_t triangle) {
  std::array<Eigen::Vector3d, 3> corners;
  for (std::size_t i = 0; i < 3; ++i) {
    corners[i] = mesh.vertices[mesh.triangles[triangle][i]].cast<double>();
  }
  return corners;
}

Eigen::Vector3d nearest_point(const std::array<Eigen::Vector3d, 3>& corners, const Eigen::Vector3d& point) {
  const auto& [a, b, c] = corners;
  const Eigen::Vector3d ab = b - a;
  const Eigen::Vector3d ac = c - a;
  const double d1 = ab.dot(point - a);
  const double d2 = ac.dot(point - a);
  if (d1 <= 0.0 && d2 <= 0.0) return a;
  const double d3 = ab.dot(point - b);
  const double d4 = ac.dot(point - b);
  if (d3 >= 0.0 && d4 <= d3) return b;
  const double d5 = ab.dot(point - c);
  const double d6 = ac.dot(point - c);
  if (d6 >= 0.0 && d5 <= d6) return c;
  // Twice the areas of the triangles that the point's foot spans with an edge: negative beyond that edge.
  const double beyond_ab = d1 * d4 - d3 * d2;
  if (beyond_ab <= 0.0 && d1 >= 0.0 && d3 <= 0.0) return a + d1 / (d1 - d3) * ab;
  const double beyond_ac = d5 * d2 - d1 * d6;
  if (beyond_ac <= 0.0 && d2 >= 0.0 && d6 <= 0.0) return a + d2 / (d2 - d6) * ac;
  const double beyond_bc = d3 * d6 - d5 * d4;
  if (beyond_bc <= 0.0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const double sum = beyond_bc + beyond_ac + beyond_ab;
  return a + beyond_ac / sum * ab + beyond_ab / sum * ac;
}

}  // namespace

std::optional<Hit> intersect_plane_of(const TriangleMesh& mesh, std::size_t triangle, const Ray& ray) {
  const auto [a, b, c] = corners(mesh, triangle);
  const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
  const double approach = normal.dot(ray.direction);
  if (approach == 0.0) return std::nullopt;
  return Hit{normal.dot(a - ray.origin) / approach, normal, mesh.reflectivity};
}

double distance_to(const TriangleMesh& mesh, std::size_t triangle, const Eigen::Vector3d& point) {
  return (nearest_point(corners(mesh, triangle), point) - point).norm();
}

}  // namespace ignis::sim
