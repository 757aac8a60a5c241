// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

namespace ignis {

/// Wall times of one stage of the pipeline.
class StageTimer {
 public:
  /// Runs `work` and remembers how long it took.
  template <class Work>
  decltype(auto) time(Work&& work) {
    const Stop stop{*this, std::chrono::steady_clock::now()};
    return work();
  }

  [[nodiscard]] std::size_t calls() const { return milliseconds_.size(); }
  [[nodiscard]] double newest_ms() const { return milliseconds_.empty() ? 0.0 : milliseconds_.back(); }
  [[nodiscard]] double total_ms() const {
    double sum = 0.0;
    for (const double value : milliseconds_) sum += value;
    return sum;
  }
  /// The value below which `ratio` of all calls lie; 0 without calls.
  [[nodiscard]] double quantile_ms(double ratio) const {
    if (milliseconds_.empty()) return 0.0;
    std::vector<double> sorted = milliseconds_;
    const auto rank = static_cast<std::ptrdiff_t>(ratio * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
    return sorted[static_cast<std::size_t>(rank)];
  }

 private:
  struct Stop {
    StageTimer& timer;
    std::chrono::steady_clock::time_point began;
    ~Stop() {
      const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - began;
      timer.milliseconds_.push_back(spent.count());
    }
  };

  std::vector<double> milliseconds_;
};

}  // namespace ignis
