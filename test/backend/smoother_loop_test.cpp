// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "backend/smoother.h"
#include "backend/synthetic_drive.h"
#include "common/fingerprint.h"

/// Loops from the search to their withdrawal.
namespace ignis {
namespace {

std::vector<Pose> poses_of(const Smoother& smoother) {
  std::vector<Pose> poses;
  for (const KeyframePose& pose : smoother.all_poses()) poses.push_back(pose.T_map_body);
  return poses;
}

std::vector<Pose> odometry(const testing::Drive& drive) {
  std::vector<Pose> poses;
  for (const Keyframe& keyframe : drive.keyframes) poses.push_back(keyframe.state.T_odom_body);
  return poses;
}

Smoother run(const testing::Drive& drive, const BackendConfig& config, std::vector<LoopResult>* loops = nullptr) {
  Smoother smoother(config, LoopGates());
  for (const Keyframe& keyframe : drive.keyframes) {
    const SmootherUpdate update = smoother.add_keyframe(keyframe);
    EXPECT_TRUE(update.accepted()) << update.reason;
    if (loops != nullptr && update.loop) loops->push_back(*update.loop);
  }
  return smoother;
}

Matrix6d information(double sigma_rad, double sigma_m) {
  Vector6d diagonal;
  diagonal << Eigen::Vector3d::Constant(1.0 / (sigma_rad * sigma_rad)),
      Eigen::Vector3d::Constant(1.0 / (sigma_m * sigma_m));
  return diagonal.asDiagonal();
}

BackendConfig without_loops() {
  BackendConfig config;
  config.use_loop_closing = false;
  return config;
}

TEST(SmootherLoops, RemoveTheDriftOfTwoLaps) {
  const testing::Drive drive = testing::make_drive({.seed = 2, .keyframes = 45, .cloud_points = 3000});
  std::vector<LoopResult> loops;
  const Smoother smoother = run(drive, BackendConfig(), &loops);
  const double before = testing::position_error(odometry(drive), drive.T_world_body);
  const double chain = testing::position_error(poses_of(run(drive, without_loops())), drive.T_world_body);
  const double after = testing::position_error(poses_of(smoother), drive.T_world_body);
  std::printf("position error: odometry %.3f m, smoothed without loops %.3f m, with %d loops %.3f m\n", before, chain,
              smoother.stats().loops_kept, after);
  EXPECT_GE(smoother.stats().loops_kept, 5);
  EXPECT_EQ(smoother.stats().loops_withdrawn, 0);
  EXPECT_LT(after, 0.4 * before);
  EXPECT_LT(after, 0.4 * chain);
  int previous = -100;
  for (const LoopResult& loop : loops) {
    if (!loop.accepted()) continue;
    EXPECT_GE(loop.from_id - loop.to_id, 10);
    EXPECT_GE(loop.from_id - previous, 2) << "spacing";
    previous = loop.from_id;
    const Pose T_true = drive.T_world_body[static_cast<std::size_t>(loop.to_id)].inverse() *
                        drive.T_world_body[static_cast<std::size_t>(loop.from_id)];
    EXPECT_LT(body_difference(T_true, loop.T_to_from).tail<3>().norm(), 0.1);
  }
}

TEST(SmootherLoops, KeepOnePointPerVoxelOfACloud) {
  testing::Drive drive = testing::make_drive({.seed = 2, .keyframes = 2, .cloud_points = 500});
  const auto journal_bytes = [&] {
    Smoother smoother{BackendConfig(), LoopGates()};
    for (const Keyframe& keyframe : drive.keyframes) static_cast<void>(smoother.add_keyframe(keyframe));
    return smoother.take_change().size();
  };
  const std::size_t once = journal_bytes();
  for (Keyframe& keyframe : drive.keyframes) {
    const std::vector<CloudPoint> cloud = keyframe.cloud;
    keyframe.cloud.insert(keyframe.cloud.end(), cloud.begin(), cloud.end());
  }
  EXPECT_EQ(journal_bytes(), once);
}

TEST(SmootherLoops, StopAtTheFirstCandidateThatTheMatchConfirms) {
  // On the third lap there are two candidates side by side, either of which would do.
  const testing::Drive drive = testing::make_drive({.seed = 2, .keyframes = 55, .cloud_points = 3000});
  std::vector<LoopResult> loops;
  static_cast<void>(run(drive, BackendConfig(), &loops));
  int with_a_choice = 0;
  for (const LoopResult& loop : loops) {
    if (loop.candidates < 2 || !loop.accepted()) continue;
    EXPECT_EQ(loop.passed, 1);
    if (loop.from_id - loop.to_id > 30) ++with_a_choice;
  }
  EXPECT_GE(with_a_choice, 1) << "the oldest goes first";
}

TEST(SmootherLoops, SayWhyThereIsNone) {
  const testing::Drive drive = testing::make_drive({.seed = 2, .keyframes = 30, .cloud_points = 1500});
  std::vector<LoopResult> disabled;
  std::vector<LoopResult> loops;
  static_cast<void>(run(drive, without_loops(), &disabled));
  static_cast<void>(run(drive, BackendConfig(), &loops));
  const auto count = [](const std::vector<LoopResult>& all, LoopReason reason) {
    return std::ranges::count(all, reason, &LoopResult::reason);
  };
  EXPECT_EQ(count(disabled, LoopReason::kDisabled), 30);
  ASSERT_EQ(loops.size(), 30U);
  EXPECT_GE(count(loops, LoopReason::kNoCandidate), 15);
  EXPECT_GE(count(loops, LoopReason::kAccepted), 1);
  EXPECT_GE(count(loops, LoopReason::kTooSoon), 1);
  for (std::size_t i = 0; i < loops.size(); ++i) {
    EXPECT_EQ(loops[i].keyframes, static_cast<int>(i) + 1);
    EXPECT_FALSE(loops[i].reason_text.empty());
  }
}

TEST(SmootherLoops, RefuseWhatOdometryCannotExplain) {
  const testing::Drive drive = testing::make_drive({.seed = 6, .keyframes = 30});
  Smoother smoother = run(drive, without_loops());
  const auto before = poses_of(smoother);
  Vector6d lie;
  lie << 0.0, 0.3, 0.0, 2.0, 0.0, 2.2;
  const Pose T_to_from = perturbed_in_body(before[2].inverse() * before[24], lie);
  const SmootherUpdate update = smoother.add_loop({24, 2, T_to_from, information(0.003, 0.02)});
  ASSERT_TRUE(update.loop);
  EXPECT_EQ(update.loop->reason, LoopReason::kContradictsOdometry);
  EXPECT_EQ(update.loop->stage, LoopStage::kVerified);
  EXPECT_GT(update.loop->chi_square, update.loop->chi_square_bound);
  EXPECT_EQ(smoother.stats().loops_kept, 0);
  EXPECT_EQ(smoother.stats().loops_waiting, 0);
  const auto after = poses_of(smoother);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(after[i].translation, before[i].translation);
}

TEST(SmootherLoops, RefuseAFalseOneThatOnlyTheGraphContradicts) {
  const testing::Drive drive = testing::make_drive({.seed = 6, .keyframes = 30});
  BackendConfig config = without_loops();
  config.loop_drift_scale = 100.0;  // neither odometry nor other loops object: only the graph does
  config.loop_support_beyond_m = 1000.0;
  Smoother smoother = run(drive, config);
  const auto before = poses_of(smoother);
  Vector6d lie;
  lie << 0.0, 0.3, 0.0, 2.0, 0.0, 2.2;
  const Pose T_to_from = perturbed_in_body(before[2].inverse() * before[24], lie);
  const SmootherUpdate update = smoother.add_loop({24, 2, T_to_from, information(0.003, 0.02)});
  ASSERT_TRUE(update.loop);
  EXPECT_EQ(update.loop->reason, LoopReason::kContradictsGraph);
  EXPECT_EQ(update.loop->stage, LoopStage::kVerified);
  EXPECT_GT(update.loop->chi_square, update.loop->chi_square_bound);
  EXPECT_EQ(smoother.stats().loops_kept, 0);
  EXPECT_EQ(smoother.stats().loops_waiting, 1);
  const auto after = poses_of(smoother);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(after[i].translation, before[i].translation);
}

TEST(SmootherLoops, KeepATrueOneFoundElsewhere) {
  const testing::Drive drive = testing::make_drive({.seed = 6, .keyframes = 30});
  Smoother smoother = run(drive, without_loops());
  const double before = testing::position_error(poses_of(smoother), drive.T_world_body);
  const Pose T_to_from = drive.T_world_body[2].inverse() * drive.T_world_body[24];
  const SmootherUpdate update = smoother.add_loop({24, 2, T_to_from, information(0.003, 0.02)});
  EXPECT_TRUE(update.loop->accepted()) << update.loop->reason_text;
  EXPECT_LT(testing::position_error(poses_of(smoother), drive.T_world_body), before);
  const PoseGraph graph = smoother.pose_graph();
  EXPECT_EQ(graph.vertices.size(), 30U);
  ASSERT_EQ(graph.edges.size(), 30U);
  EXPECT_TRUE(graph.edges.back().is_loop);
  EXPECT_EQ(graph.edges.back().from, 2);
  EXPECT_EQ(graph.edges.back().to, 24);
}

TEST(SmootherLoops, WithdrawAnEarlierOneOnceOthersContradictIt) {
  const testing::Drive drive = testing::make_drive({.seed = 8, .keyframes = 24});
  Smoother smoother = run(drive, without_loops());
  // A lie that the drift of a lap could explain.
  Vector6d lie = Vector6d::Zero();
  lie(3) = 0.25;
  const Pose T_true = drive.T_world_body[1].inverse() * drive.T_world_body[22];
  const SmootherUpdate trial = smoother.add_loop({22, 1, perturbed_in_body(T_true, lie), information(0.02, 0.02)});
  ASSERT_TRUE(trial.loop->accepted()) << trial.loop->reason_text;
  // Each of the others alone is too vague to say anything against it.
  std::vector<LoopResult> withdrawn;
  for (int i = 0; i < 40 && withdrawn.empty(); ++i) {
    const SmootherUpdate update = smoother.add_loop({22, 1, T_true, information(0.02, 0.1)});
    EXPECT_TRUE(update.loop->accepted()) << update.loop->reason_text;
    withdrawn = update.changed;
    EXPECT_TRUE(withdrawn.empty() || i > 3);
  }
  ASSERT_EQ(withdrawn.size(), 2U) << "it goes, and then waits";
  EXPECT_EQ(withdrawn[0].reason, LoopReason::kWithdrawn);
  EXPECT_EQ(withdrawn[1].reason, LoopReason::kContradictsGraph);
  EXPECT_EQ(withdrawn[1].stage, LoopStage::kVerified);
  EXPECT_LT(body_difference(T_true, withdrawn[0].T_to_from).tail<3>().norm(), 0.26);
  EXPECT_GT(body_difference(T_true, withdrawn[0].T_to_from).tail<3>().norm(), 0.24);
  const auto poses = poses_of(smoother);
  EXPECT_LT(body_difference(T_true, poses[1].inverse() * poses[22]).tail<3>().norm(), 0.05);
}

TEST(SmootherLoops, RefuseWhatTheGraphDoesNotHoldOrIsNotFinite) {
  const testing::Drive drive = testing::make_drive({.keyframes = 12});
  Smoother smoother = run(drive, without_loops());
  const auto reason = [&](const LoopMeasurement& loop) { return smoother.add_loop(loop).loop->reason; };
  EXPECT_EQ(reason({11, 99, Pose(), information(0.01, 0.01)}), LoopReason::kSolverRefused);
  EXPECT_EQ(reason({11, 11, Pose(), information(0.01, 0.01)}), LoopReason::kSolverRefused);
  EXPECT_EQ(reason({11, 0, Pose(), Matrix6d::Zero()}), LoopReason::kSolverRefused);
  Pose broken;
  broken.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(reason({11, 0, broken, information(0.01, 0.01)}), LoopReason::kSolverRefused);
  EXPECT_EQ(smoother.stats().loops_kept, 0);
}

TEST(SmootherLoops, GiveTheSameBytesTwice) {
  const auto fingerprint = [] {
    const testing::Drive drive = testing::make_drive({.seed = 11, .keyframes = 40, .cloud_points = 2000});
    const Smoother smoother = run(drive, BackendConfig());
    EXPECT_GE(smoother.stats().loops_kept, 1);
    Fingerprint print;
    for (const KeyframePose& pose : smoother.all_poses()) {
      for (const double v : pose.T_map_body.translation) print.add(v);
      for (const double v : pose.T_map_body.rotation.coeffs()) print.add(v);
    }
    return print.text();
  };
  EXPECT_EQ(fingerprint(), fingerprint());
}

}  // namespace
}  // namespace ignis
