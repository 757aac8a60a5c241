// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/shared_ptr.hpp>
#include <cstdint>

#include "common/keyframe.h"

namespace gtsam {
class NonlinearFactor;
}

namespace ignis {

/// What a wall in sight told of a keyframe's speed. Error: the body's speed along the axis, by pose and velocity (map
/// axes), less the one that was told [m/s].
[[nodiscard]] boost::shared_ptr<gtsam::NonlinearFactor> make_sighted_speed_factor(std::uint64_t pose_key,
                                                                                  std::uint64_t velocity_key,
                                                                                  const SightedSpeed& sighted);

}  // namespace ignis
