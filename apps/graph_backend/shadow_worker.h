// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include "backend/shadow_optimum.h"

namespace ignis {

/// Solves one batch problem at a time on a thread of its own; seconds for thousands of keyframes. All calls from one
/// thread. Ends with the solve that is under way.
class ShadowWorker {
 public:
  ShadowWorker();

  /// True when it has nothing to do and nothing to hand over.
  [[nodiscard]] bool idle();

  /// Requires idle().
  void start(ShadowProblem problem);

  /// The result, once.
  [[nodiscard]] std::optional<ShadowOptimum> take();

 private:
  void run(const std::stop_token& stop);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<ShadowProblem> problem_;
  std::optional<ShadowOptimum> optimum_;
  bool solving_ = false;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace ignis
