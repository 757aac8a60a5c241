// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>

namespace ignis {

/// Token bucket: `burst` at once, `per_second` in the long run.
class RateLimit {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  RateLimit(double per_second, double burst) : per_second_(per_second), burst_(burst), tokens_(burst) {}

  /// Takes a token; false when none is left.
  [[nodiscard]] bool allow(TimePoint now) {
    const double waited = std::chrono::duration<double>(now - last_).count();
    tokens_ = std::min(burst_, tokens_ + per_second_ * waited);
    last_ = now;
    if (tokens_ < 1.0) return false;
    tokens_ -= 1.0;
    return true;
  }

 private:
  double per_second_;
  double burst_;
  double tokens_;
  TimePoint last_ = std::chrono::steady_clock::now();
};

}  // namespace ignis
