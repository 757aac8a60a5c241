// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "drivers/sim/mesh.h"

namespace ignis::sim {

/// The bounded geometry that stands still, in one bounding volume hierarchy of Embree. World frame, metres.
///
/// Embree works in single precision; here it only finds what a ray meets. Solids answer with their closed form in
/// double, a triangle with the double intersection of its plane, so hits are exact and do not depend on the
/// instruction set. Immutable after construction, so any number of threads may cast. Starts no threads.
class RayKernel {
 public:
  /// Throws std::runtime_error when Embree cannot build the hierarchy.
  RayKernel(std::vector<Solid> solids, std::vector<TriangleMesh> meshes);
  ~RayKernel();
  RayKernel(RayKernel&&) noexcept;
  RayKernel& operator=(RayKernel&&) noexcept;

  /// Nearest surface along the ray, nearer than `limit` [m].
  [[nodiscard]] std::optional<Hit> cast(const Ray& ray, double limit) const;

  /// Distance from a point to the nearest surface [m], negative inside a solid, infinite when there is nothing.
  [[nodiscard]] double clearance(const Eigen::Vector3d& point) const;

  [[nodiscard]] const std::vector<Solid>& solids() const;
  [[nodiscard]] const std::vector<TriangleMesh>& meshes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ignis::sim
