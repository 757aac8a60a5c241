// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/ray_scene.h"

#include <algorithm>

namespace ignis::sim {

RayScene::RayScene(std::vector<Plane> planes, std::vector<Solid> solids, std::vector<TriangleMesh> meshes,
                   std::vector<Mover> movers)
    : planes_(std::move(planes)), kernel_(std::move(solids), std::move(meshes)), movers_(std::move(movers)) {}

std::optional<Hit> RayScene::cast(const Ray& ray, double limit, double time) const {
  std::optional<Hit> nearest;
  const auto keep = [&](const std::optional<Hit>& hit) {
    if (!hit) return;
    nearest = hit;
    limit = hit->distance;
  };
  // The cheap ones first: they shorten the ray for the hierarchy.
  for (const Plane& plane : planes_) keep(intersect(plane, ray, limit));
  for (const Mover& mover : movers_) keep(mover.cast(ray, limit, time));
  keep(kernel_.cast(ray, limit));
  return nearest;
}

double RayScene::clearance(const Eigen::Vector3d& point, double time) const {
  double nearest = kernel_.clearance(point);
  for (const Plane& plane : planes_) nearest = std::min(nearest, signed_distance(plane, point));
  for (const Mover& mover : movers_) nearest = std::min(nearest, mover.clearance(point, time));
  return nearest;
}

}  // namespace ignis::sim
