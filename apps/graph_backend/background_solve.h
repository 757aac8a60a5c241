// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <stop_token>
#include <utility>

#include "backend/shadow/shadow_optimum.h"

namespace ignis {

/// The batch solution under way in a second thread. Nobody waits longer than for one of its iterations to be rid of it.
class BackgroundSolve {
 public:
  using GotOn = std::function<void()>;
  using Solve = std::function<ShadowOptimum(const ShadowProblem&, const std::stop_token&, const GotOn&)>;

  /// Longer without an iteration is a hang: all of a solution takes 0.5 to 0.9 s for 3,000 to 5,000 keyframes.
  static constexpr std::chrono::milliseconds kLongestIteration{1000};

  explicit BackgroundSolve(Solve solve = ignis::solve) : solve_(std::move(solve)) {}
  ~BackgroundSolve() { drop(); }
  BackgroundSolve(const BackgroundSolve&) = delete;
  BackgroundSolve& operator=(const BackgroundSolve&) = delete;

  /// Drops what is under way and begins with another graph.
  void begin(ShadowProblem problem) {
    drop();
    stop_ = std::stop_source();
    const auto count = [this] { ++iterations_; };
    optimum_ = std::async(std::launch::async, solve_, std::move(problem), stop_.get_token(), count);
  }

  /// Waits for what was begun last. Meanwhile calls `got_on` again and again, as long as its iterations come to an end.
  [[nodiscard]] ShadowOptimum take(const GotOn& got_on) {
    std::int64_t seen = iterations_;
    auto last = std::chrono::steady_clock::now();
    while (optimum_.wait_for(kSlice) != std::future_status::ready) {
      const auto now = std::chrono::steady_clock::now();
      if (std::exchange(seen, iterations_.load()) != seen) last = now;
      if (now - last < kLongestIteration) got_on();
    }
    return optimum_.get();
  }

  /// What is under way is no longer wanted.
  void drop() { stop_.request_stop(); }

 private:
  static constexpr std::chrono::milliseconds kSlice{100};

  Solve solve_;
  std::stop_source stop_;
  std::atomic<std::int64_t> iterations_ = 0;  // of all solutions
  std::future<ShadowOptimum> optimum_;        // waits in its destructor, and when it is replaced
};

}  // namespace ignis
