// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "common/time.h"
#include "ignis/health_t.hpp"

namespace ignis {

/// Something that a live receiver or the recorder missed. From here on a replay may differ from the live run.
struct RecordedDrop {
  Utime utime = 0;   ///< [us] of the last message ahead of the gap, or of the last report that knows nothing of it
  std::string what;  ///< channel and count, in words
};

/// The earlier one of two drops.
[[nodiscard]] inline std::optional<RecordedDrop> earlier(std::optional<RecordedDrop> a, std::optional<RecordedDrop> b) {
  if (!a || (b && b->utime < a->utime)) return b;
  return a;
}

/// What a HEALTH message of the live front end says that it missed of the sensors' channels; empty when it missed none,
/// and for other processes: their losses are mended by asking again and do not change the front end's results.
[[nodiscard]] std::string loss_in(const health_t& health);

}  // namespace ignis
