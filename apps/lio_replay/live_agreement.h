// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/time.h"
#include "frontend/scan_stats.h"

namespace ignis {

/// How a replay compares with the live run whose results lie in the same log.
struct LiveAgreement {
  std::int64_t recorded = 0;           ///< results of scans that the live front end published, within what was replayed
  std::int64_t equal = 0;              ///< of these, equal bit for bit in every field but the time spent
  std::optional<Utime> first_unequal;  ///< [us] stamp of the first one that differs or that the replay does not have
  double largest_distance_m = 0.0;     ///< between recorded and replayed positions
  std::int32_t first_sequence = 0;     ///< running number of the first recorded one: not 0 when the recorder came late

  [[nodiscard]] bool complete() const { return recorded > 0 && equal == recorded; }
};

/// Compares the recorded LIO_SCAN_STATS (encoded, in any order) with those of a replay.
[[nodiscard]] LiveAgreement agreement_with_live(std::span<const std::span<const std::byte>> recorded,
                                                const std::vector<ScanStats>& replayed);

}  // namespace ignis
