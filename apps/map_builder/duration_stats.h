// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ignis {

/// How long the last thousand runs of one kind took [ms].
class DurationStats {
 public:
  void add(double milliseconds) {
    newest_[static_cast<std::size_t>(count_ % static_cast<std::int64_t>(newest_.size()))] = milliseconds;
    ++count_;
    max_ = std::max(max_, milliseconds);
  }
  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] double max() const { return max_; }  ///< ever
  [[nodiscard]] double quantile(double ratio) const {
    const auto held = std::min(count_, static_cast<std::int64_t>(newest_.size()));
    if (held == 0) return 0.0;
    std::vector<double> sorted(newest_.begin(), newest_.begin() + held);
    const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>(ratio * static_cast<double>(held - 1));
    std::ranges::nth_element(sorted, nth);
    return *nth;
  }

 private:
  std::array<double, 1000> newest_{};
  std::int64_t count_ = 0;
  double max_ = 0.0;
};

/// Runs `work` and adds the wall time that it took.
template <class Work>
auto timed(DurationStats& stats, Work&& work) {
  const auto began = std::chrono::steady_clock::now();
  auto result = work();
  stats.add(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count());
  return result;
}

}  // namespace ignis
