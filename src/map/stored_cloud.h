// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "common/measurements.h"
#include "map/free_space.h"

namespace ignis {

/// A run of neighbouring points of a cloud, so that a reader can pass over those that lie elsewhere.
struct CloudBlock {
  static constexpr double kEdge = 2.0;  ///< [m] of the cube, axes of the cloud
  Eigen::Vector3f centre;               ///< [m] of the cube
  std::uint32_t begin = 0;              ///< of its points
  std::uint32_t end = 0;
};

/// What is kept of a closed keyframe, in its body frame. Shared: a rebuild reads it on another thread while nobody
/// writes.
struct CloudData {
  std::vector<CloudPoint> points;
  std::vector<CloudBlock> blocks;  ///< of all points, in their order
  std::vector<FreeCell> free;      ///< cells of the mid level's size
};
using SharedCloud = std::shared_ptr<const CloudData>;

/// The same to look at.
struct StoredCloud {
  std::span<const CloudPoint> points;
  std::span<const CloudBlock> blocks;  ///< none: the points are in no order
  std::span<const FreeCell> free;
};

[[nodiscard]] inline StoredCloud view_of(const CloudData& cloud) { return {cloud.points, cloud.blocks, cloud.free}; }

}  // namespace ignis
