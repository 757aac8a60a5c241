// SPDX-License-Identifier: Apache-2.0
#include "shadow_worker.h"

#include <utility>

namespace ignis {

ShadowWorker::ShadowWorker() : thread_([this](const std::stop_token& stop) { run(stop); }) {}

bool ShadowWorker::idle() {
  const std::scoped_lock lock(mutex_);
  return !problem_ && !optimum_ && !solving_;
}

void ShadowWorker::start(ShadowProblem problem) {
  const std::scoped_lock lock(mutex_);
  problem_ = std::move(problem);
  changed_.notify_one();
}

std::optional<ShadowOptimum> ShadowWorker::take() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(optimum_, std::nullopt);
}

void ShadowWorker::run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [this] { return problem_.has_value(); })) {
    const ShadowProblem problem = *std::exchange(problem_, std::nullopt);
    solving_ = true;
    lock.unlock();
    ShadowOptimum optimum = solve(problem);
    lock.lock();
    optimum_ = std::move(optimum);
    solving_ = false;
  }
}

}  // namespace ignis
