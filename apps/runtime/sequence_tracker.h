// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

namespace ignis::runtime {

/// Counts what a receiver missed by the sender's running number. LCM over UDP counts nothing itself.
class SequenceTracker {
 public:
  /// Messages missed between the newest one seen so far and this one. Parts of one sequence, repeats and late arrivals
  /// count nothing; keyframes sent again have old numbers. A number far below the newest means a new sender.
  std::int64_t observe(std::int32_t sequence) {
    // 64 bits wide: a forged number may be the smallest or the largest there is.
    constexpr std::int64_t kRestartDistance = 1000;
    if (!newest_ || sequence < std::int64_t{*newest_} - kRestartDistance) {
      newest_ = sequence;
      return 0;
    }
    if (sequence <= *newest_) return 0;
    const std::int64_t missed = static_cast<std::int64_t>(sequence) - *newest_ - 1;
    newest_ = sequence;
    return missed;
  }

 private:
  std::optional<std::int32_t> newest_;
};

}  // namespace ignis::runtime
