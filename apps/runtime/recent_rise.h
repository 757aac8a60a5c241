// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace ignis::runtime {

/// Whether a counter of troubles has risen lately. What HEALTH says is about now: one trouble long ago must not hide
/// the next.
class RecentRise {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  explicit RecentRise(std::chrono::seconds lately) : lately_(lately) {}

  /// Takes the counter's present value. One that has fallen counts something new from there on.
  [[nodiscard]] bool look(std::int64_t count, TimePoint now) {
    if (count > count_) rose_ = now;
    if (count < count_) rose_.reset();
    count_ = count;
    return rose_ && now - *rose_ < lately_;
  }

 private:
  std::chrono::seconds lately_;
  std::int64_t count_ = 0;
  std::optional<TimePoint> rose_;
};

}  // namespace ignis::runtime
