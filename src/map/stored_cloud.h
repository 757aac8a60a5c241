// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "common/measurements.h"
#include "map/free_space.h"

namespace ignis {

/// What is kept of a closed keyframe, in its body frame. Shared: a rebuild reads it on another thread while nobody
/// writes.
struct CloudData {
  std::vector<CloudPoint> points;
  std::vector<FreeCell> free;  ///< cells of the mid level's size
};
using SharedCloud = std::shared_ptr<const CloudData>;

/// The same to look at.
struct StoredCloud {
  std::span<const CloudPoint> points;
  std::span<const FreeCell> free;
};

[[nodiscard]] inline StoredCloud view_of(const CloudData& cloud) { return {cloud.points, cloud.free}; }

}  // namespace ignis
