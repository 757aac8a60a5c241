// SPDX-License-Identifier: Apache-2.0
#include "graph_backend/shadow_worker.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "backend/smoother.h"
#include "backend/synthetic_drive.h"

namespace ignis {
namespace {

Smoother driven(int keyframes) {
  BackendConfig config;
  config.use_loop_closing = false;
  Smoother smoother(config, LoopGates{});
  for (const Keyframe& keyframe : testing::make_drive({.seed = 4, .keyframes = keyframes}).keyframes) {
    EXPECT_TRUE(smoother.add_keyframe(keyframe).accepted());
  }
  return smoother;
}

std::optional<ShadowOptimum> wait_for(ShadowWorker& worker) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (std::chrono::steady_clock::now() < deadline) {
    if (auto optimum = worker.take()) return optimum;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return std::nullopt;
}

TEST(ShadowWorker, HandsOverTheSameOptimumAsASolveInPlaceAndOnlyOnce) {
  Smoother smoother = driven(12);
  const ShadowProblem problem = smoother.shadow_problem();
  const ShadowOptimum expected = solve(problem);
  ShadowWorker worker;
  EXPECT_TRUE(worker.idle());
  EXPECT_FALSE(worker.take().has_value());
  worker.start(problem);
  const auto optimum = wait_for(worker);
  ASSERT_TRUE(optimum.has_value());
  ASSERT_TRUE(expected.solved && optimum->solved);
  EXPECT_EQ(optimum->half_chi_square, expected.half_chi_square);
  EXPECT_EQ(optimum->largest_gap_m, expected.largest_gap_m);
  EXPECT_FALSE(worker.take().has_value());
  EXPECT_TRUE(worker.idle());
}

TEST(ShadowWorker, IsBusyFromStartUntilItsResultIsTaken) {
  Smoother smoother = driven(12);
  ShadowWorker worker;
  worker.start(smoother.shadow_problem());
  std::optional<ShadowOptimum> optimum;
  while (!optimum) {
    // Nobody else takes the result, so it cannot be idle between here and there.
    EXPECT_FALSE(worker.idle());
    optimum = worker.take();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(worker.idle());
}

TEST(ShadowWorker, SolvesOneProblemAfterAnother) {
  ShadowWorker worker;
  for (const int keyframes : {6, 9}) {
    Smoother smoother = driven(keyframes);
    worker.start(smoother.shadow_problem());
    const auto optimum = wait_for(worker);
    ASSERT_TRUE(optimum.has_value());
    EXPECT_TRUE(optimum->solved);
    EXPECT_EQ(smoother.adopt(*optimum).verdict, KeyframeVerdict::kAccepted);
    EXPECT_EQ(smoother.stats().shadow_checks, 1);
  }
}

TEST(ShadowWorker, EndsWithASolveUnderWay) {
  Smoother smoother = driven(40);
  ShadowWorker worker;
  worker.start(smoother.shadow_problem());
}

}  // namespace
}  // namespace ignis
