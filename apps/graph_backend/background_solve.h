// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <future>
#include <stop_token>
#include <utility>

#include "backend/shadow_optimum.h"

namespace ignis {

/// The batch solution under way in a second thread. Nobody waits longer than for one of its iterations to be rid of it.
class BackgroundSolve {
 public:
  using Solve = std::function<ShadowOptimum(const ShadowProblem&, const std::stop_token&)>;

  explicit BackgroundSolve(Solve solve = ignis::solve) : solve_(std::move(solve)) {}
  ~BackgroundSolve() { drop(); }
  BackgroundSolve(const BackgroundSolve&) = delete;
  BackgroundSolve& operator=(const BackgroundSolve&) = delete;

  /// Drops what is under way and begins with another graph.
  void begin(ShadowProblem problem) {
    drop();
    stop_ = std::stop_source();
    optimum_ = std::async(std::launch::async, solve_, std::move(problem), stop_.get_token());
  }

  /// Waits for what was begun last.
  [[nodiscard]] ShadowOptimum take() { return optimum_.get(); }

  /// What is under way is no longer wanted.
  void drop() { stop_.request_stop(); }

 private:
  Solve solve_;
  std::stop_source stop_;
  std::future<ShadowOptimum> optimum_;  // waits in its destructor, and when it is replaced
};

}  // namespace ignis
