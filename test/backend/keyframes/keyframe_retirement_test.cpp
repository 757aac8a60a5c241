// SPDX-License-Identifier: Apache-2.0
//
// A graph whose oldest keyframes have retired, beside one that estimates all of them.
#include "backend/keyframes/keyframe_retirement.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

#include "backend/laps.h"
#include "backend/smoother.h"
#include "backend/synthetic_drive.h"
#include "backend/text_contains.h"

namespace ignis {
namespace {

constexpr int kWholeGraph = 1000;

using testing::kLap;
using testing::Laps;
using testing::loop_in;
using testing::without_search;

TEST(KeyframeRetirement, BoundsWhatIsEstimated) {
  const Laps laps(150, 40, true);
  const SmootherStats stats = laps.smoother.stats();
  EXPECT_EQ(stats.keyframes, 150);
  EXPECT_LE(stats.keyframes - stats.retired, 40);
  EXPECT_GT(stats.keyframes - stats.retired, 30);
  EXPECT_EQ(Laps(40, 40, true).smoother.stats().retired, 0) << "as many may be estimated";
}

TEST(KeyframeRetirement, CostsLapsThatLoopsTieTogetherLittleAccuracy) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const double whole = Laps(200, kWholeGraph, true, seed).error();
    const double bounded = Laps(200, 50, true, seed).error();
    EXPECT_LT(bounded, 1.6 * whole) << "seed " << seed << ", and two laps and a half are few to agree on a place";
    EXPECT_GT(Laps(200, 50, false, seed).error(), 3.0 * bounded) << "else loops have nothing to do here";
  }
}

/// To condition on what has retired is to take it for exact. What is published must not.
TEST(KeyframeRetirement, DoesNotMakeThePublishedPoseSurerThanItWas) {
  const Laps whole(200, kWholeGraph, true);
  const Laps bounded(200, 80, true);
  ASSERT_TRUE(whole.last.covariance_valid && bounded.last.covariance_valid);
  EXPECT_GT(bounded.smoother.stats().retired, 0);
  for (int i = 0; i < 6; ++i) {
    EXPECT_GT(bounded.last.covariance(i, i), 0.8 * whole.last.covariance(i, i)) << i;
    EXPECT_LT(bounded.last.covariance(i, i), 4.0 * whole.last.covariance(i, i)) << i;
  }
}

/// Heights would be as unsure as the tilt of the start makes them there, a kilometre away.
TEST(KeyframeRetirement, DoesNotDependOnWhereTheMapBegins) {
  const auto covariance = [](double away_m) {
    testing::Drive drive = testing::make_drive({.seed = 3, .keyframes = 120});
    Smoother smoother(without_search(40), LoopGates());
    SmootherUpdate last;
    for (Keyframe& keyframe : drive.keyframes) {
      keyframe.state.T_odom_body.translation.x() += away_m;
      last = smoother.add_keyframe(keyframe);
      if (keyframe.id < kLap || keyframe.id % 3 != 0) continue;
      static_cast<void>(smoother.add_loop(loop_in(drive, keyframe.id, keyframe.id % kLap)));
    }
    EXPECT_GT(smoother.stats().retired, 0);
    return last.covariance;
  };
  const Matrix6d here = covariance(0.0);
  const Matrix6d there = covariance(1000.0);
  for (int i = 3; i < 6; ++i) EXPECT_LT(there(i, i), 3.0 * here(i, i)) << i;
}

TEST(KeyframeRetirement, WhatIsNotKnownToADecimetreDoesNotRetire) {
  Laps laps(120, 40, false);
  EXPECT_LE(laps.smoother.stats().retired, 10) << "nothing ties this drive to its start";
  Laps whole(120, kWholeGraph, false);
  for (int id = 117; id < 120; ++id) {
    const LoopMeasurement loop = loop_in(laps.drive, id, id % kLap);
    EXPECT_EQ(laps.smoother.add_loop(loop).loop->reason, whole.smoother.add_loop(loop).loop->reason);
  }
  EXPECT_NEAR(laps.error(), whole.error(), 0.1 * whole.error());
}

/// Of the newest pose, per degree of freedom, over twenty drives.
double mean_nees(int keyframes, int estimated_keyframes) {
  constexpr unsigned kSeeds = 20;
  double sum = 0.0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const Laps laps(keyframes, estimated_keyframes, true, seed);
    EXPECT_TRUE(laps.last.covariance_valid);
    const Vector6d error = body_difference(laps.drive.T_world_body.back(), laps.smoother.all_poses().back().T_map_body);
    sum += error.dot(laps.last.covariance.ldlt().solve(error)) / 6.0;
  }
  return sum / kSeeds;
}

TEST(KeyframeRetirement, LeavesThePublishedPoseAboutAsHonestAsItWas) {
  const double change = mean_nees(100, 40) / mean_nees(100, kWholeGraph);
  EXPECT_GT(change, 0.6);
  EXPECT_LT(change, 1.6);
}

/// The future had its say in what retires; it must not have it twice.
TEST(KeyframeRetirement, MovesNothingThatIsEstimated) {
  Laps laps(40, 40, true);
  const std::vector<KeyframePose> before = laps.smoother.all_poses();
  const testing::Drive longer = testing::make_drive({.seed = 3, .keyframes = 41});
  ASSERT_TRUE(laps.smoother.add_keyframe(longer.keyframes[40]).accepted());
  ASSERT_GT(laps.smoother.stats().retired, 0);
  Laps whole(40, kWholeGraph, true);
  ASSERT_TRUE(whole.smoother.add_keyframe(longer.keyframes[40]).accepted());
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Vector6d moved =
        body_difference(whole.smoother.all_poses()[i].T_map_body, laps.smoother.all_poses()[i].T_map_body);
    EXPECT_LT(moved.tail<3>().norm(), 1e-3) << i;
    EXPECT_LT(moved.head<3>().norm(), 1e-4) << i;
  }
}

TEST(KeyframeRetirement, ALieAboutAPlaceThatHasRetiredIsRefusedAndATruthIsNot) {
  Laps laps(120, 40, true);
  EXPECT_FALSE(laps.smoother.add_loop(loop_in(laps.drive, 119, 119 % kLap + kLap, 1.0)).loop->accepted());
  EXPECT_TRUE(laps.smoother.add_loop(loop_in(laps.drive, 118, 118 % kLap + kLap)).loop->accepted());
}

TEST(KeyframeRetirement, ALoopToAKnownPlaceCanStillBeWithdrawn) {
  Laps laps(100, 40, true);
  const int loops = laps.smoother.stats().loops_kept;
  const SmootherUpdate update = laps.smoother.withdraw_loop(99, 99 % kLap);
  ASSERT_EQ(update.changed.size(), 1U);
  EXPECT_EQ(update.changed.front().stage, LoopStage::kWithdrawn);
  EXPECT_EQ(laps.smoother.stats().loops_kept, loops - 1);
}

TEST(KeyframeRetirement, ALoopBetweenTwoThatHaveRetiredStaysAndSaysSo) {
  Laps laps(100, 40, true);
  const int loops = laps.smoother.stats().loops_kept;
  const std::int32_t revision = laps.smoother.revision();
  const SmootherUpdate update = laps.smoother.withdraw_loop(24, 24 % kLap);
  ASSERT_TRUE(update.loop);
  EXPECT_TRUE(testing::contains(update.loop->reason_text, "have retired"));
  EXPECT_EQ(update.revision, revision);
  EXPECT_EQ(laps.smoother.stats().loops_kept, loops);
  const PoseGraph graph = laps.smoother.pose_graph();
  EXPECT_TRUE(std::ranges::any_of(graph.edges, [](const PoseGraphEdge& edge) {
    return edge.is_loop && edge.from == 24 % kLap && edge.to == 24;
  })) << "and is exported";
  EXPECT_FALSE(laps.smoother.withdraw_loop(25, 25 % kLap).loop) << "there was none";
}

TEST(KeyframeRetirement, EveryLoopThatLeavesTheListSaysWhy) {
  const Laps laps(150, 40, true);
  const auto kept = std::ranges::count(laps.changed, LoopReason::kKept, &LoopResult::reason);
  const SmootherStats stats = laps.smoother.stats();
  EXPECT_EQ(stats.loops_withdrawn, 0);
  EXPECT_EQ(kept, stats.loops_kept - stats.loops_on_trial);
}

TEST(KeyframeRetirement, ALoopThatWaitsIsForgottenWithItsKeyframesAndSaysSo) {
  const testing::Drive drive = testing::make_drive({.seed = 3, .keyframes = 80});
  Smoother smoother(without_search(40), LoopGates());
  std::vector<LoopResult> changed;
  for (const Keyframe& keyframe : drive.keyframes) {
    const SmootherUpdate update = smoother.add_keyframe(keyframe);
    changed.insert(changed.end(), update.changed.begin(), update.changed.end());
    if (keyframe.id == 23) {
      EXPECT_TRUE(smoother.add_loop(loop_in(drive, 23, 2)).loop->accepted());
    }
    if (keyframe.id == 24) {
      EXPECT_FALSE(smoother.add_loop(loop_in(drive, 24, 3, 0.3)).loop->accepted());
    }
  }
  EXPECT_EQ(smoother.stats().loops_waiting, 0);
  const auto forgotten = std::ranges::find_if(
      changed, [](const LoopResult& loop) { return testing::contains(loop.reason_text, "forgotten: both"); });
  ASSERT_NE(forgotten, changed.end());
  EXPECT_EQ(forgotten->from_id, 24);
  EXPECT_EQ(forgotten->stage, LoopStage::kWithdrawn);
}

TEST(KeyframeRetirement, ALoopBetweenTwoThatHaveRetiredIsRefusedWithTheReason) {
  Laps laps(100, 40, true);
  const SmootherUpdate update = laps.smoother.add_loop(loop_in(laps.drive, 25, 4));
  EXPECT_EQ(update.loop->reason, LoopReason::kSolverRefused);
  EXPECT_TRUE(testing::contains(update.loop->reason_text, "have retired"));
}

TEST(KeyframeRetirement, ABatchSolutionFromBeforeItIsStillTaken) {
  Laps laps(40, 40, true);
  const ShadowOptimum optimum = solve(laps.smoother.shadow_problem());
  ASSERT_TRUE(optimum.solved);
  EXPECT_EQ(optimum.keyframes, 40);
  ASSERT_TRUE(laps.smoother.add_keyframe(testing::make_drive({.seed = 3, .keyframes = 41}).keyframes[40]).accepted());
  ASSERT_GT(laps.smoother.stats().retired, 0);
  static_cast<void>(laps.smoother.adopt(optimum));
  EXPECT_EQ(laps.smoother.stats().shadow_checks, 1);
}

TEST(KeyframeRetirement, TheBatchSolutionIsThatOfWhatIsEstimated) {
  Laps laps(120, 40, true);
  const ShadowOptimum optimum = solve(laps.smoother.shadow_problem());
  ASSERT_TRUE(optimum.solved);
  const SmootherStats stats = laps.smoother.stats();
  EXPECT_EQ(optimum.keyframes, stats.keyframes - stats.retired);
  EXPECT_LT(optimum.largest_gap_m, 1e-3);
  static_cast<void>(laps.smoother.adopt(optimum));
  EXPECT_EQ(laps.smoother.stats().shadow_checks, 1);
}

}  // namespace
}  // namespace ignis
