// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <format>
#include <iostream>

namespace ignis {

/// Tells on the error stream, every few seconds, how far a simulation is and how long it will still take.
class Progress {
 public:
  explicit Progress(double total_s) : total_s_(total_s) {}

  /// `done_s`: simulated time so far [s].
  void show(double done_s) {
    const Clock::time_point now = Clock::now();
    if (now - shown_ < kInterval) return;
    shown_ = now;
    const double left_s = elapsed() * (total_s_ - done_s) / std::max(done_s, 1e-3);
    std::cerr << std::format("l1_sim: {:.0f} of {:.0f} s simulated, {:.0f} s left\n", done_s, total_s_, left_s);
  }

  /// Wall time since construction [s].
  [[nodiscard]] double elapsed() const { return std::chrono::duration<double>(Clock::now() - began_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kInterval{5};

  double total_s_;
  Clock::time_point began_ = Clock::now();
  Clock::time_point shown_ = began_;
};

}  // namespace ignis
