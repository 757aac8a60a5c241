// SPDX-License-Identifier: Apache-2.0
#include "graph_backend/background_solve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

namespace ignis {
namespace {

using GotOn = BackgroundSolve::GotOn;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kSolve{5};
const auto kNobody = [] {};

/// A solve that takes long, but looks often whether it is still wanted.
ShadowOptimum slow_solve(const ShadowProblem&, const std::stop_token& stop, const GotOn&) {
  for (const auto end = Clock::now() + kSolve; Clock::now() < end && !stop.stop_requested();) {
    std::this_thread::sleep_for(milliseconds(1));
  }
  return {};
}

TEST(BackgroundSolve, GivesWhatItHasBegunLast) {
  BackgroundSolve background([](const ShadowProblem&, const std::stop_token&, const GotOn&) {
    ShadowOptimum optimum;
    optimum.keyframes = 7;
    return optimum;
  });
  background.begin({});
  EXPECT_EQ(background.take(kNobody).keyframes, 7);
  background.begin({});
  EXPECT_EQ(background.take(kNobody).keyframes, 7) << "the earlier one was not stopped with it";
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
  static_cast<void>(background.take(kNobody));
  EXPECT_LT(Clock::now() - began, kSolve / 2);
}

/// How often the waiting thread is told that a solution goes on, and the longest pause in between. Its iterations take
/// so long, that often, and then it stands still for a while.
struct Told {
  int times = 0;
  Clock::duration longest_pause{};
};
Told told_of(milliseconds iteration, int iterations, Clock::duration stands_still) {
  BackgroundSolve background([&](const ShadowProblem&, const std::stop_token&, const GotOn& got_on) {
    for (int i = 0; i < iterations; ++i) {
      std::this_thread::sleep_for(iteration);
      got_on();
    }
    std::this_thread::sleep_for(stands_still);
    return ShadowOptimum{};
  });
  Told told;
  background.begin({});
  auto last = Clock::now();
  static_cast<void>(background.take([&] {
    const auto now = Clock::now();
    told.longest_pause = std::max(told.longest_pause, now - std::exchange(last, now));
    ++told.times;
  }));
  return told;
}

TEST(Fault_P7, ALongBatchSolutionStarvesNoWatchdogWhileItsIterationsEnd) {
  const Told told = told_of(milliseconds(300), 8, {});
  EXPECT_GE(told.times, 8) << "in 2.4 s";
  EXPECT_LT(told.longest_pause, seconds(1)) << "half of the units' WatchdogSec";
}

TEST(Fault_P7, ABatchSolutionThatHangsStarvesTheWatchdog) {
  constexpr auto kPause = 3 * BackgroundSolve::kLongestIteration;
  const auto began = Clock::now();
  const Told told = told_of(milliseconds(1), 1, kPause);
  EXPECT_GE(Clock::now() - began, kPause);
  EXPECT_LE(told.times, BackgroundSolve::kLongestIteration / milliseconds(100)) << "fed though nothing went on";
}

}  // namespace
}  // namespace ignis
