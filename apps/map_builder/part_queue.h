// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

namespace ignis {

/// Parts of keyframes and of corrections that may wait for this process, of `configured` ones.
///
/// What waits is held by LCM, whose buffer grows by half whenever it is full and never shrinks. A part is up to 60 kB,
/// so these are at most 18 MB for each channel. What finds no place is not lost for good: a missing keyframe is asked
/// for again, and the corrections come in full every two seconds.
[[nodiscard]] constexpr int part_queue(int configured) {
  constexpr int kMaxWaitingParts = 300;
  return std::min(configured, kMaxWaitingParts);
}

}  // namespace ignis
