// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "drivers/sim/mover.h"
#include "drivers/sim/ray_kernel.h"

namespace ignis::sim {

/// All geometry of a scene, ready for casting: solids and meshes in a bounding volume hierarchy, a short list of
/// unbounded planes, and what moves. World frame, metres. Immutable after construction, so any number of threads may
/// cast.
class RayScene {
 public:
  RayScene(std::vector<Plane> planes, std::vector<Solid> solids, std::vector<TriangleMesh> meshes = {},
           std::vector<Mover> movers = {});

  /// Nearest surface along the ray, nearer than `limit` [m], with what moves where it is at `time` [s].
  [[nodiscard]] std::optional<Hit> cast(const Ray& ray, double limit, double time = 0.0) const;

  /// Distance from a point to the nearest surface [m], negative inside a solid. Meshes have no inside.
  [[nodiscard]] double clearance(const Eigen::Vector3d& point, double time = 0.0) const;

  [[nodiscard]] const std::vector<Plane>& planes() const { return planes_; }
  [[nodiscard]] const std::vector<Solid>& solids() const { return kernel_.solids(); }
  [[nodiscard]] const std::vector<TriangleMesh>& meshes() const { return kernel_.meshes(); }
  [[nodiscard]] const std::vector<Mover>& movers() const { return movers_; }

 private:
  std::vector<Plane> planes_;
  RayKernel kernel_;
  std::vector<Mover> movers_;
};

}  // namespace ignis::sim
