// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "common/pose.h"

namespace ignis {

/// A measured relative pose between two places of a chain.
struct ChainLoop {
  std::size_t earlier = 0;  ///< index of the revisited pose
  std::size_t later = 0;    ///< index of the pose that revisits it
  Pose T_earlier_later;     ///< as measured
};

/// The reference's distributed correction, kept as a baseline for the factor graph: the error of the loop (world axes:
/// a translation and a rotation vector) is spread over the poses between both ends in proportion to the distance driven
/// since the earlier one, so the newest takes it in full; what follows the loop moves rigidly with its end. Poses are
/// T_world_body. Nothing is returned when the translation exceeds `max_correction_m` or the indices are no loop.
[[nodiscard]] std::optional<std::vector<Pose>> distribute_loop_correction(std::span<const Pose> chain,
                                                                          const ChainLoop& loop,
                                                                          double max_correction_m);

}  // namespace ignis
