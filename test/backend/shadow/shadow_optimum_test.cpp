// SPDX-License-Identifier: Apache-2.0
#include "backend/shadow/shadow_optimum.h"

#include <gtest/gtest.h>

#include "backend/smoother.h"
#include "backend/synthetic_drive.h"

namespace ignis {
namespace {

constexpr double kFar = 10.0;  // [m] or [1]: so lazy that nothing is ever linearised anew

BackendConfig without_search() {
  BackendConfig config;
  config.use_loop_closing = false;
  config.loop_support_beyond_m = 1000.0;
  return config;
}

/// A solver that keeps its first linearisation points, so that it ends beside the optimum.
BackendConfig lazy() {
  BackendConfig config = without_search();
  config.solver.relinearize_position_m = config.solver.relinearize_rotation_rad = 1.0;
  config.solver.relinearize_velocity = config.solver.relinearize_bias = kFar;
  config.solver.relinearize_skip = 100;
  config.loop_consistency_probability = 0.9999999;
  return config;
}

Matrix6d information() {
  Vector6d diagonal;
  diagonal << Eigen::Vector3d::Constant(1.0 / (0.05 * 0.05)), Eigen::Vector3d::Constant(1.0 / (0.2 * 0.2));
  return diagonal.asDiagonal();
}

void extend(Smoother& smoother, const testing::Drive& drive, std::size_t first, std::size_t last) {
  for (std::size_t i = first; i < last; ++i) ASSERT_TRUE(smoother.add_keyframe(drive.keyframes[i]).accepted());
}

void close(Smoother& smoother, const testing::Drive& drive, int from, int to) {
  const Pose T_to_from =
      drive.T_world_body[static_cast<std::size_t>(to)].inverse() * drive.T_world_body[static_cast<std::size_t>(from)];
  const SmootherUpdate update = smoother.add_loop({from, to, T_to_from, information()});
  ASSERT_TRUE(update.loop->accepted()) << update.loop->reason_text;
}

testing::Drive drifting() {
  return testing::make_drive({.seed = 3, .keyframes = 50, .odometry_sigma_m = 0.05, .odometry_sigma_rad = 0.02});
}

TEST(ShadowOptimum, LiesWhereACarefulSolverStands) {
  const testing::Drive drive = testing::make_drive({.seed = 3, .keyframes = 45});
  Smoother smoother(without_search(), LoopGates());
  extend(smoother, drive, 0, 45);
  close(smoother, drive, 42, 1);
  const ShadowOptimum optimum = solve(smoother.shadow_problem());
  ASSERT_TRUE(optimum.solved);
  EXPECT_EQ(optimum.keyframes, 45);
  EXPECT_EQ(optimum.revision, smoother.revision());
  EXPECT_LT(optimum.largest_gap_m, 2e-3);
  EXPECT_LT(optimum.largest_gap_rad, 2e-4);
  EXPECT_LE(optimum.half_chi_square, optimum.half_chi_square_before);
  const auto revision = smoother.revision();
  static_cast<void>(smoother.adopt(optimum));
  EXPECT_EQ(smoother.revision(), revision) << "nothing to swap";
  EXPECT_EQ(smoother.stats().shadow_checks, 1);
  EXPECT_EQ(smoother.stats().shadow_swaps, 0);
  EXPECT_EQ(smoother.stats().shadow_gap_m, optimum.largest_gap_m);
}

TEST(ShadowOptimum, TakesThePlaceOfALazySolution) {
  const testing::Drive drive = drifting();
  Smoother smoother(lazy(), LoopGates());
  extend(smoother, drive, 0, 45);
  close(smoother, drive, 42, 1);
  const ShadowOptimum optimum = solve(smoother.shadow_problem());
  ASSERT_TRUE(optimum.solved);
  ASSERT_GT(optimum.largest_gap_m, lazy().shadow_swap_m) << "the case is too easy";
  const auto revision = smoother.revision();
  const SmootherUpdate update = smoother.adopt(optimum);
  EXPECT_EQ(update.revision, revision + 1);
  EXPECT_FALSE(update.moved.empty());
  EXPECT_EQ(smoother.stats().shadow_swaps, 1);
  EXPECT_EQ(smoother.stats().solver_rebuilds, 0) << "no accident";
  EXPECT_LT(solve(smoother.shadow_problem()).largest_gap_m, 0.1 * optimum.largest_gap_m);
}

TEST(ShadowOptimum, IsCarriedOnToKeyframesThatCameMeanwhile) {
  const testing::Drive drive = drifting();
  Smoother smoother(lazy(), LoopGates());
  extend(smoother, drive, 0, 45);
  close(smoother, drive, 42, 1);
  const ShadowProblem problem = smoother.shadow_problem();
  extend(smoother, drive, 45, 50);
  const Pose before = smoother.all_poses()[44].T_map_body.inverse() * smoother.all_poses()[49].T_map_body;
  const ShadowOptimum optimum = solve(problem);
  EXPECT_EQ(optimum.keyframes, 45);
  EXPECT_FALSE(smoother.adopt(optimum).moved.empty());
  EXPECT_EQ(smoother.stats().shadow_swaps, 1);
  const Pose after = smoother.all_poses()[44].T_map_body.inverse() * smoother.all_poses()[49].T_map_body;
  EXPECT_LT(body_difference(before, after).norm(), 0.1);
  EXPECT_LT(solve(smoother.shadow_problem()).largest_gap_m, 0.2 * optimum.largest_gap_m);
}

TEST(ShadowOptimum, OfAnotherGraphIsIgnored) {
  const testing::Drive drive = drifting();
  Smoother longer(lazy(), LoopGates());
  extend(longer, drive, 0, 45);
  close(longer, drive, 42, 1);
  Smoother shorter(lazy(), LoopGates());
  extend(shorter, drive, 0, 20);
  static_cast<void>(shorter.adopt(solve(longer.shadow_problem())));
  EXPECT_EQ(shorter.stats().shadow_checks, 0);
  EXPECT_EQ(shorter.stats().shadow_swaps, 0);
}

TEST(ShadowOptimum, IsNoneWhenItIsNoLongerWanted) {
  const testing::Drive drive = testing::make_drive({.seed = 3, .keyframes = 10});
  Smoother smoother(without_search(), LoopGates());
  extend(smoother, drive, 0, 10);
  const ShadowProblem problem = smoother.shadow_problem();
  std::stop_source source;
  int iterations = 0;
  EXPECT_TRUE(solve(problem, source.get_token(), [&] { ++iterations; }).solved);
  EXPECT_GT(iterations, 0) << "whoever waits cannot tell it from one that hangs";
  source.request_stop();
  EXPECT_FALSE(solve(problem, source.get_token()).solved);
}

TEST(ShadowOptimum, OfAnEmptyGraphIsNone) {
  Smoother smoother(without_search(), LoopGates());
  const ShadowOptimum optimum = solve(smoother.shadow_problem());
  EXPECT_FALSE(optimum.solved);
  EXPECT_TRUE(smoother.adopt(optimum).moved.empty());
  EXPECT_FALSE(solve(ShadowProblem()).solved);
}

}  // namespace
}  // namespace ignis
