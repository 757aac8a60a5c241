// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "backend/loops/loop_search.h"
#include "backend/smoother.h"
#include "backend/synthetic_drive.h"

/// The life of loops that were found elsewhere: waiting, on trial, kept, withdrawn, vetoed.
namespace ignis {
namespace {

Matrix6d information(double sigma_rad, double sigma_m) {
  Vector6d diagonal;
  diagonal << Eigen::Vector3d::Constant(1.0 / (sigma_rad * sigma_rad)),
      Eigen::Vector3d::Constant(1.0 / (sigma_m * sigma_m));
  return diagonal.asDiagonal();
}

BackendConfig without_search() {
  BackendConfig config;
  config.use_loop_closing = false;
  config.loop_support_beyond_m = 1000.0;
  config.loop_drift_scale = 1.0;  // the synthetic odometry has no correlated errors
  return config;
}

/// A drive whose odometry is vague enough to swallow a lie of metres, and its graph.
struct VagueDrive {
  explicit VagueDrive(const BackendConfig& config = without_search(), int keyframes = 30)
      : drive(testing::make_drive(
            {.seed = 4, .keyframes = 45, .accel_noise = 2.0, .odometry_sigma_m = 0.15, .odometry_sigma_rad = 0.005})),
        smoother(noisy(config), LoopGates()) {
    add_keyframes(keyframes);
  }

  static BackendConfig noisy(BackendConfig config) {
    config.imu.accel_noise = 2.0;
    return config;
  }

  std::vector<LoopResult> add_keyframes(int count) {
    std::vector<LoopResult> changed;
    for (int i = 0; i < count; ++i) {
      const SmootherUpdate update = smoother.add_keyframe(drive.keyframes[next++]);
      EXPECT_TRUE(update.accepted()) << update.reason;
      changed.insert(changed.end(), update.changed.begin(), update.changed.end());
    }
    return changed;
  }

  /// A loop that is wrong by `wrong_m` to the side.
  SmootherUpdate add_loop(int from, int to, double wrong_m) {
    Vector6d lie = Vector6d::Zero();
    lie(3) = wrong_m;
    const Pose T_true =
        drive.T_world_body[static_cast<std::size_t>(to)].inverse() * drive.T_world_body[static_cast<std::size_t>(from)];
    return smoother.add_loop({from, to, perturbed_in_body(T_true, lie), information(0.003, 0.02)});
  }

  /// A loop of a group that takes one place for another: it agrees with that from 22 to 1, which is wrong by `wrong_m`.
  SmootherUpdate add_to_group(int from, int to, double wrong_m) {
    const auto truth = [&](int i) { return drive.T_world_body[static_cast<std::size_t>(i)]; };
    Vector6d lie = Vector6d::Zero();
    lie(3) = wrong_m;
    const Pose T_first = perturbed_in_body(truth(1).inverse() * truth(22), lie);
    const Pose T_to_from = truth(to).inverse() * truth(1) * T_first * truth(22).inverse() * truth(from);
    return smoother.add_loop({from, to, T_to_from, information(0.003, 0.02)});
  }

  [[nodiscard]] std::vector<Pose> poses() const {
    std::vector<Pose> poses;
    for (const KeyframePose& pose : smoother.all_poses()) poses.push_back(pose.T_map_body);
    return poses;
  }

  testing::Drive drive;
  Smoother smoother;
  std::size_t next = 0;
};

TEST(LoopTrial, AWrongLoopThatCameFirstGivesWayToTrueOnes) {
  VagueDrive run;
  const SmootherUpdate first = run.add_loop(24, 2, 1.6);
  ASSERT_TRUE(first.loop->accepted()) << "nobody knows better yet, but: " << first.loop->reason_text;
  std::vector<LoopResult> changed;
  for (int i = 0; i < 3; ++i) {
    const SmootherUpdate update = run.add_loop(25 + i, 3 + i, 0.0);
    changed.insert(changed.end(), update.changed.begin(), update.changed.end());
    if (update.loop->accepted()) continue;
    EXPECT_EQ(update.loop->reason, LoopReason::kContradictsLoops);
    EXPECT_EQ(update.loop->stage, LoopStage::kVerified);
    EXPECT_EQ(i, 0) << "two that agree outweigh one";
  }
  const auto withdrawn = std::ranges::find(changed, LoopReason::kWithdrawn, &LoopResult::reason);
  ASSERT_NE(withdrawn, changed.end());
  EXPECT_EQ(withdrawn->from_id, 24);
  EXPECT_EQ(std::ranges::count(changed, LoopReason::kWithdrawn, &LoopResult::reason), 1);
  EXPECT_EQ(run.smoother.stats().loops_kept, 3);
  EXPECT_EQ(run.smoother.stats().loops_waiting, 1);
  const Pose T_to_from = run.poses()[4].inverse() * run.poses()[26];
  EXPECT_LT(
      body_difference(run.drive.T_world_body[4].inverse() * run.drive.T_world_body[26], T_to_from).tail<3>().norm(),
      0.05);
}

TEST(LoopTrial, AWrongLoopAmongTrueOnesWaitsOutside) {
  VagueDrive run;
  for (int i = 1; i < 4; ++i) ASSERT_TRUE(run.add_loop(24 + i, 2 + i, 0.0).loop->accepted());
  const auto before = run.poses();
  const SmootherUpdate update = run.add_loop(24, 2, 1.6);
  EXPECT_EQ(update.loop->reason, LoopReason::kContradictsLoops);
  EXPECT_TRUE(update.changed.empty());
  EXPECT_EQ(run.smoother.stats().loops_kept, 3);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(run.poses()[i].translation, before[i].translation);
}

/// Pairs of loops are not compared, so that only the graph can tell.
BackendConfig without_consistency() {
  BackendConfig config = without_search();
  config.loop_drift_scale = 100.0;
  return config;
}

TEST(LoopTrial, WrongLoopsThatCameFirstGiveWayToMoreThatTheGraphContradicts) {
  VagueDrive run(without_consistency());
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(run.add_to_group(22 + i, 1 + i, 2.4).loop->accepted()) << i;
  std::vector<LoopResult> changed;
  for (int i = 0; i < 4; ++i) {
    const SmootherUpdate update = run.add_loop(24 + i, 3 + i, 0.0);
    if (i < 2) {
      EXPECT_EQ(update.loop->reason, LoopReason::kContradictsGraph) << i;
    }
    changed.insert(changed.end(), update.changed.begin(), update.changed.end());
  }
  EXPECT_EQ(std::ranges::count(changed, LoopReason::kWithdrawn, &LoopResult::reason), 2);
  EXPECT_EQ(run.smoother.stats().loops_kept, 4);
  EXPECT_EQ(run.smoother.stats().loops_waiting, 2);
  const PoseGraph graph = run.smoother.pose_graph();
  for (const PoseGraphEdge& edge : graph.edges) {
    if (!edge.is_loop) continue;
    EXPECT_GE(edge.to, 24);
  }
}

TEST(LoopTrial, IsNotOverWhileOnlyNeighboursThatSayTheSameSpeakForALoop) {
  BackendConfig config = without_search();
  config.loop_trial_keyframes = 2;
  config.loop_support_beyond_m = 1.0;  // odometry would let pass what is wrong by three times as much
  VagueDrive run(config);
  for (int i = 0; i < 3; ++i) static_cast<void>(run.add_loop(24 + i, 3 + i, 0.0));
  EXPECT_EQ(run.smoother.stats().loops_kept, 3);
  for (const LoopResult& change : run.add_keyframes(8)) EXPECT_NE(change.stage, LoopStage::kKept);
  EXPECT_EQ(run.smoother.stats().loops_on_trial, 3);
}

TEST(LoopTrial, WaitsForASecondWitnessElsewhereWhereOdometryIsVague) {
  BackendConfig config = without_search();
  config.loop_support_beyond_m = 0.5;
  config.loop_support_apart_m = 10.0;
  VagueDrive run(config);
  // 3 m from each other, the two would agree in any place that looks like theirs.
  for (const auto& [from, to] : {std::pair{24, 2}, {25, 3}}) {
    const SmootherUpdate update = run.add_loop(from, to, 0.0);
    EXPECT_EQ(update.loop->reason, LoopReason::kNeedsSupport);
    EXPECT_EQ(update.loop->stage, LoopStage::kVerified);
  }
  EXPECT_EQ(run.smoother.stats().loops_kept, 0);
  EXPECT_EQ(run.smoother.stats().loops_waiting, 2);
  // 11 m from the first, 9 m from the second, which the first vouches for once it is in the graph.
  const SmootherUpdate elsewhere = run.add_loop(28, 7, 0.0);
  EXPECT_TRUE(elsewhere.loop->accepted()) << elsewhere.loop->reason_text;
  ASSERT_EQ(elsewhere.changed.size(), 2U);
  EXPECT_TRUE(elsewhere.changed[0].accepted());
  EXPECT_EQ(elsewhere.changed[0].from_id, 24);
  EXPECT_TRUE(elsewhere.changed[1].accepted());
  EXPECT_EQ(elsewhere.changed[1].from_id, 25);
  EXPECT_EQ(run.smoother.stats().loops_kept, 3);
  EXPECT_EQ(run.smoother.stats().loops_waiting, 0);
}

TEST(LoopTrial, IsOverAfterSomeKeyframesWithoutContradiction) {
  BackendConfig config = without_search();
  config.loop_trial_keyframes = 4;
  VagueDrive run(config);
  const SmootherUpdate update = run.add_loop(24, 2, 0.0);
  EXPECT_EQ(update.loop->stage, LoopStage::kOnTrial);
  EXPECT_EQ(run.smoother.stats().loops_on_trial, 1);
  EXPECT_TRUE(run.add_keyframes(3).empty());
  const std::vector<LoopResult> changed = run.add_keyframes(1);
  ASSERT_EQ(changed.size(), 1U);
  EXPECT_EQ(changed[0].stage, LoopStage::kKept);
  EXPECT_EQ(changed[0].reason, LoopReason::kKept);
  EXPECT_FALSE(changed[0].accepted());
  EXPECT_EQ(run.smoother.stats().loops_on_trial, 0);
  EXPECT_EQ(run.smoother.stats().loops_kept, 1);
  EXPECT_TRUE(run.add_keyframes(3).empty()) << "once";
}

TEST(LoopTrial, EndsByCommand) {
  VagueDrive run;
  const auto before = run.poses();
  ASSERT_TRUE(run.add_loop(24, 2, 0.0).loop->accepted());
  EXPECT_TRUE(run.smoother.withdraw_loop(24, 3).changed.empty()) << "another pair";
  const std::int32_t revision = run.smoother.revision();
  const SmootherUpdate update = run.smoother.withdraw_loop(24, 2);
  ASSERT_EQ(update.changed.size(), 1U);
  EXPECT_EQ(update.changed[0].reason, LoopReason::kWithdrawn);
  EXPECT_EQ(update.changed[0].stage, LoopStage::kWithdrawn);
  EXPECT_EQ(update.revision, revision + 1);
  EXPECT_EQ(run.smoother.stats().loops_kept, 0);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_LT((run.poses()[i].translation - before[i].translation).norm(), 0.02);
  }
  EXPECT_TRUE(run.add_loop(24, 2, 0.0).loop->accepted()) << "withdrawn is not forbidden";
}

TEST(LoopTrial, NeverBeginsForAVetoedPairAndItsNeighbours) {
  VagueDrive run;
  ASSERT_TRUE(run.add_loop(24, 2, 0.0).loop->accepted());
  EXPECT_EQ(run.smoother.veto_loop(24, 2).changed.size(), 1U);
  for (const auto& [from, to] : {std::pair{24, 2}, {25, 3}, {22, 4}, {26, 0}}) {
    const SmootherUpdate update = run.add_loop(from, to, 0.0);
    EXPECT_EQ(update.loop->reason, LoopReason::kVetoed) << from << " " << to;
  }
  EXPECT_TRUE(run.add_loop(27, 2, 0.0).loop->accepted());
  EXPECT_TRUE(run.add_loop(24, 5, 0.0).loop->accepted());
}

TEST(LoopTrial, AVetoThatIsKnownIsNotWrittenAgain) {
  VagueDrive run;
  static_cast<void>(run.smoother.take_change());
  const std::size_t nothing = run.smoother.take_change().size();
  static_cast<void>(run.smoother.veto_loop(24, 2));
  const std::size_t veto = run.smoother.take_change().size();
  EXPECT_GT(veto, nothing);
  static_cast<void>(run.smoother.veto_loop(24, 2));
  EXPECT_EQ(run.smoother.take_change().size(), nothing);
  static_cast<void>(run.smoother.veto_loop(24, 3));
  EXPECT_EQ(run.smoother.take_change().size(), veto) << "another pair is";
}

TEST(LoopTrial, AVetoOfNumbersThatNoGraphHoldsForbidsNothing) {
  // Journals written before such commands were refused may hold them.
  constexpr std::int32_t kSmallest = std::numeric_limits<std::int32_t>::min();
  const std::vector<LoopVeto> vetoes{{24, kSmallest}, {kSmallest, 2}};
  EXPECT_FALSE(is_vetoed(vetoes, 24, 0, 2));
  EXPECT_FALSE(is_vetoed(vetoes, 0, 2, 2));
}

TEST(LoopTrial, OfMoreThanAHundredThatWaitTheOldestIsForgottenAndSaysSo) {
  BackendConfig config = without_search();
  config.loop_support_beyond_m = 0.5;
  config.loop_support_apart_m = 10.0;
  VagueDrive run(config);
  ASSERT_EQ(run.add_loop(25, 3, 0.0).loop->reason, LoopReason::kNeedsSupport);
  for (int i = 1; i < 100; ++i) EXPECT_TRUE(run.add_loop(24, 2, 0.0).changed.empty()) << i;
  const SmootherUpdate update = run.add_loop(24, 2, 0.0);
  EXPECT_EQ(run.smoother.stats().loops_waiting, 100);
  ASSERT_EQ(update.changed.size(), 1U);
  EXPECT_EQ(update.changed[0].from_id, 25);
  EXPECT_EQ(update.changed[0].stage, LoopStage::kWithdrawn);
  EXPECT_EQ(update.changed[0].reason, LoopReason::kNeedsSupport);
  EXPECT_EQ(update.changed[0].reason_text, "forgotten: more than 100 loops wait");
  EXPECT_EQ(update.loop->stage, LoopStage::kVerified);
}

TEST(LoopSearch, LeavesVetoedNeighbourhoodsAlone) {
  const testing::Drive drive = testing::make_drive({.seed = 2, .keyframes = 24, .cloud_points = 3000});
  Smoother free{BackendConfig(), LoopGates()};
  Smoother forbidden{BackendConfig(), LoopGates()};
  for (int from = 10; from < 24; ++from) {
    for (int to = 0; to < 24; ++to) static_cast<void>(forbidden.veto_loop(from, to));
  }
  LoopResult last;
  std::string said;
  for (const Keyframe& keyframe : drive.keyframes) {
    said += free.add_keyframe(keyframe).loop->reason_text + '\n';
    last = *forbidden.add_keyframe(keyframe).loop;
  }
  EXPECT_GE(free.stats().loops_kept, 1) << said;
  EXPECT_EQ(forbidden.stats().loops_kept, 0);
  EXPECT_EQ(last.reason, LoopReason::kVetoed);
}

TEST(LoopSearch, BoundsTheCorrectionByDistanceOrByCovariance) {
  const testing::Drive drive = testing::make_drive({.seed = 2, .keyframes = 24, .cloud_points = 4000});
  LoopGates gates;
  gates.loop_max_correction_m = 0.01;
  const auto reasons = [&](const char* gate) {
    BackendConfig config;
    config.loop_correction_gate = gate;
    Smoother smoother(config, gates);
    std::vector<LoopReason> all;
    for (const Keyframe& keyframe : drive.keyframes) all.push_back(smoother.add_keyframe(keyframe).loop->reason);
    return all;
  };
  const std::vector<LoopReason> by_distance = reasons("distance");
  EXPECT_GE(std::ranges::count(by_distance, LoopReason::kCorrectionTooLarge), 1);
  EXPECT_EQ(std::ranges::count(by_distance, LoopReason::kAccepted), 0);
  const std::vector<LoopReason> by_covariance = reasons("covariance");
  EXPECT_EQ(std::ranges::count(by_covariance, LoopReason::kCorrectionTooLarge), 0);
  EXPECT_GE(std::ranges::count(by_covariance, LoopReason::kAccepted), 1);
}

TEST(LoopSearch, ClosesNoHundredLoopsWhileTheVehicleIsParked) {
  testing::Drive drive = testing::make_drive({.keyframes = 60, .speed = 0.0, .turn_rate = 1e-9, .cloud_points = 4000});
  Smoother smoother{BackendConfig(), LoopGates()};
  int searched = 0;
  for (const Keyframe& keyframe : drive.keyframes) {
    const SmootherUpdate update = smoother.add_keyframe(keyframe);
    if (update.loop->candidates > 0) ++searched;
  }
  EXPECT_GE(smoother.stats().loops_kept, 1);
  EXPECT_LE(smoother.stats().loops_kept, 2);
  EXPECT_LE(searched, 4);
}

}  // namespace
}  // namespace ignis
