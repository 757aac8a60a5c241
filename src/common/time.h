// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace ignis {

/// Instant of a measurement [us], on whatever clock the log or the driver uses. Always an integer: a double of seconds
/// since 1970 resolves microseconds only by luck.
using Utime = std::int64_t;

inline constexpr std::int64_t kMicrosPerSecond = 1'000'000;

/// Seconds from `from` to `to` [s]. Subtracts as integers first, so nothing is lost.
[[nodiscard]] constexpr double seconds_between(Utime from, Utime to) { return static_cast<double>(to - from) * 1e-6; }

/// The nearest whole microsecond of a duration in seconds.
[[nodiscard]] constexpr std::int64_t to_micros(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e6 + (seconds < 0 ? -0.5 : 0.5));
}

}  // namespace ignis
