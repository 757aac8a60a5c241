// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "drivers/sim/solids.h"

namespace ignis::sim {

/// All geometry of a scene, ready for casting: a bounding volume tree over the solids, and a short list of unbounded
/// planes. World frame, metres. Immutable after construction, so any number of threads may cast.
class RayScene {
 public:
  RayScene(std::vector<Plane> planes, std::vector<Solid> solids);

  /// Nearest surface along the ray, nearer than `limit` [m].
  [[nodiscard]] std::optional<Hit> cast(const Ray& ray, double limit) const;

  /// Distance from a point to the nearest surface [m], negative inside a solid.
  [[nodiscard]] double clearance(const Eigen::Vector3d& point) const;

  [[nodiscard]] const std::vector<Plane>& planes() const { return planes_; }
  [[nodiscard]] const std::vector<Solid>& solids() const { return solids_; }

 private:
  /// A leaf holds `count` solids from `first`; an inner node (count 0) has its children at the next index and at
  /// `first`.
  struct Node {
    Eigen::AlignedBox3d box;
    int first = 0;
    int count = 0;
  };

  int build(int begin, int end);

  std::vector<Plane> planes_;
  std::vector<Solid> solids_;
  std::vector<Node> nodes_;
};

}  // namespace ignis::sim
