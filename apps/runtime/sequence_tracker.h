// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "common/time.h"

namespace ignis::runtime {

/// Counts what a receiver missed by the sender's running number. LCM over UDP counts nothing itself.
class SequenceTracker {
 public:
  /// Messages missed between the newest one seen so far and this one, with its stamp `utime`. Parts of one sequence,
  /// repeats and late arrivals count nothing; keyframes sent again have old numbers and old stamps. An old number with
  /// a newer stamp is one of a sender that began anew, and so is one that lies far back, whatever its stamp.
  std::int64_t observe(std::int32_t sequence, Utime utime) {
    // 64 bits wide: a forged number may be the smallest or the largest there is.
    constexpr std::int64_t kRestartDistance = 1000;
    const bool is_news = !newest_ || sequence > *newest_;
    const bool begins_anew = newest_ && (sequence < std::int64_t{*newest_} - kRestartDistance ||
                                         (sequence < *newest_ && utime > newest_utime_));
    if (!is_news && !begins_anew) return 0;
    const std::int64_t missed = newest_ && is_news ? std::int64_t{sequence} - *newest_ - 1 : 0;
    newest_ = sequence;
    newest_utime_ = begins_anew ? utime : std::max(newest_utime_, utime);
    ++fresh_;
    return missed;
  }

  /// Messages that were no parts of the same sequence, repeats or late arrivals.
  [[nodiscard]] std::int64_t fresh() const { return fresh_; }

 private:
  std::optional<std::int32_t> newest_;
  Utime newest_utime_ = 0;  // [us]
  std::int64_t fresh_ = 0;
};

}  // namespace ignis::runtime
