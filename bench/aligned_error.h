// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "common/pose.h"

namespace ignis::bench {

/// [m] Root mean square distance of positions after the best rigid alignment.
[[nodiscard]] double aligned_error(const std::vector<Pose>& estimate, const std::vector<Pose>& truth);

}  // namespace ignis::bench
