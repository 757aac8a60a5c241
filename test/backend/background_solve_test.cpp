// SPDX-License-Identifier: Apache-2.0
#include "graph_backend/background_solve.h"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <thread>

namespace ignis {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kSolve{5};

/// A solve that takes long, but looks often whether it is still wanted.
ShadowOptimum slow_solve(const ShadowProblem&, const std::stop_token& stop) {
  for (const auto end = Clock::now() + kSolve; Clock::now() < end && !stop.stop_requested();) {
    std::this_thread::sleep_for(milliseconds(1));
  }
  return {};
}

TEST(BackgroundSolve, GivesWhatItHasBegunLast) {
  BackgroundSolve background([](const ShadowProblem&, const std::stop_token&) {
    ShadowOptimum optimum;
    optimum.keyframes = 7;
    return optimum;
  });
  background.begin({});
  EXPECT_EQ(background.take().keyframes, 7);
  background.begin({});
  EXPECT_EQ(background.take().keyframes, 7) << "the earlier one was not stopped with it";
}

TEST(BackgroundSolve, KeepsNobodyWaitingAtTheEnd) {
  std::optional<BackgroundSolve> background(std::in_place, slow_solve);
  background->begin({});
  const auto began = Clock::now();
  background.reset();
  EXPECT_LT(Clock::now() - began, kSolve / 2);
}

TEST(BackgroundSolve, KeepsNobodyWaitingForOneThatWasDropped) {
  BackgroundSolve background(slow_solve);
  const auto began = Clock::now();
  for (int i = 0; i < 3; ++i) background.begin({});
  background.drop();
  static_cast<void>(background.take());
  EXPECT_LT(Clock::now() - began, kSolve / 2);
}

}  // namespace
}  // namespace ignis
