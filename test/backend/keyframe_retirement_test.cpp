// SPDX-License-Identifier: Apache-2.0
//
// A graph whose oldest keyframes have retired, beside one that estimates all of them.
#include "backend/keyframe_retirement.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

#include "backend/smoother.h"
#include "backend/synthetic_drive.h"
#include "backend/text_contains.h"

namespace ignis {
namespace {

constexpr int kLap = 21;  // keyframes of the synthetic drive
constexpr int kWholeGraph = 1000;

BackendConfig without_search(int estimated_keyframes) {
  BackendConfig config;
  config.use_loop_closing = false;
  config.estimated_keyframes = estimated_keyframes;
  return config;
}

LoopMeasurement loop_in(const testing::Drive& drive, int from, int to, double wrong_m = 0.0) {
  Vector6d lie = Vector6d::Zero();
  lie(3) = wrong_m;
  const auto truth = [&](int id) { return drive.T_world_body[static_cast<std::size_t>(id)]; };
  Vector6d information;
  information << Eigen::Vector3d::Constant(1.0 / (0.003 * 0.003)), Eigen::Vector3d::Constant(1.0 / (0.02 * 0.02));
  return {from, to, perturbed_in_body(truth(to).inverse() * truth(from), lie), information.asDiagonal()};
}

/// Laps of the same circle. From the second lap on every third keyframe closes a loop to the first one, if at all.
struct Laps {
  Laps(int keyframes, int estimated_keyframes, bool with_loops, unsigned seed = 3)
      : drive(testing::make_drive({.seed = seed, .keyframes = keyframes})),
        smoother(without_search(estimated_keyframes), LoopGates()) {
    for (const Keyframe& keyframe : drive.keyframes) {
      last = smoother.add_keyframe(keyframe);
      EXPECT_TRUE(last.accepted()) << last.reason;
      note(last.changed);
      if (!with_loops || keyframe.id < kLap || keyframe.id % 3 != 0) continue;
      const SmootherUpdate update = smoother.add_loop(loop_in(drive, keyframe.id, keyframe.id % kLap));
      EXPECT_TRUE(update.loop->accepted()) << update.loop->reason_text;
      note(update.changed);
    }
  }

  void note(const std::vector<LoopResult>& news) { changed.insert(changed.end(), news.begin(), news.end()); }

  [[nodiscard]] double error() const {
    std::vector<Pose> poses;
    for (const KeyframePose& pose : smoother.all_poses()) poses.push_back(pose.T_map_body);
    return testing::position_error(poses, drive.T_world_body);
  }

  testing::Drive drive;
  Smoother smoother;
  SmootherUpdate last;
  std::vector<LoopResult> changed;  ///< of all updates
};

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
  const Laps whole(100, kWholeGraph, false);
  const Laps bounded(100, 30, false);
  ASSERT_TRUE(whole.last.covariance_valid && bounded.last.covariance_valid);
  const Matrix6d& surer = bounded.last.covariance;
  const Matrix6d& honest = whole.last.covariance;
  for (int i = 0; i < 6; ++i) {
    EXPECT_GT(surer(i, i), 0.2 * honest(i, i)) << i;
    EXPECT_LT(surer(i, i), 1.5 * honest(i, i)) << i;
  }
}

/// Of the newest pose, per degree of freedom, over twenty drives.
double mean_nees(int keyframes, int estimated_keyframes, bool with_loops) {
  constexpr unsigned kSeeds = 20;
  double sum = 0.0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const Laps laps(keyframes, estimated_keyframes, with_loops, seed);
    EXPECT_TRUE(laps.last.covariance_valid);
    const Vector6d error = body_difference(laps.drive.T_world_body.back(), laps.smoother.all_poses().back().T_map_body);
    sum += error.dot(laps.last.covariance.ldlt().solve(error)) / 6.0;
  }
  return sum / kSeeds;
}

/// Blocks are taken for independent of each other where no loop says more, which they are not quite.
TEST(KeyframeRetirement, LeavesThePublishedPoseAboutAsHonestAsItWas) {
  for (const bool with_loops : {false, true}) {
    const double change = mean_nees(100, 40, with_loops) / mean_nees(100, kWholeGraph, with_loops);
    EXPECT_GT(change, 0.7) << "loops: " << with_loops;
    EXPECT_LT(change, 1.6) << "loops: " << with_loops;
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

TEST(KeyframeRetirement, ALoopBetweenTwoThatHaveRetiredIsRefusedWithTheReason) {
  Laps laps(100, 40, true);
  const SmootherUpdate update = laps.smoother.add_loop(loop_in(laps.drive, 25, 4));
  EXPECT_EQ(update.loop->reason, LoopReason::kSolverRefused);
  EXPECT_TRUE(testing::contains(update.loop->reason_text, "have retired"));
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
