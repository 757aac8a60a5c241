// SPDX-License-Identifier: Apache-2.0
//
// A graph of which the passes of a place are one, beside one that keeps all of them.
#include "backend/keyframes/keyframe_thinning.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <numbers>
#include <vector>

#include "backend/laps.h"
#include "backend/loops/loop_search.h"
#include "backend/shadow/shadow_optimum.h"
#include "backend/text_contains.h"

namespace ignis {
namespace {

using testing::kLap;
using testing::Laps;
using testing::loop_in;
using testing::without_search;

constexpr double kSpacing = 2.0;

Laps thinned(int keyframes, unsigned seed = 3) { return {keyframes, 40, true, seed, kSpacing}; }

TEST(KeyframeThinning, KeepsOneOfThePassesOfAPlace) {
  const Laps laps = thinned(300);
  const SmootherStats stats = laps.smoother.stats();
  EXPECT_EQ(stats.keyframes, 300);
  EXPECT_GT(stats.absorbed, 200);
  // A lap, what is estimated, and what has retired since or is held by a loop.
  EXPECT_LT(stats.keyframes - stats.absorbed, kLap + 40 + 15);
  EXPECT_LT(laps.smoother.pose_graph().vertices.size(), static_cast<std::size_t>(kLap + 40 + 15));
}

TEST(KeyframeThinning, MovesNothingAndForgetsNoPose) {
  const Laps all(150, 40, true);
  const Laps some = thinned(150);
  ASSERT_GT(some.smoother.stats().absorbed, 60);
  const std::vector<KeyframePose> expected = all.smoother.all_poses();
  const std::vector<KeyframePose> poses = some.smoother.all_poses();
  ASSERT_EQ(poses.size(), 150U);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(poses[i].id, static_cast<std::int32_t>(i));
    EXPECT_LT(body_difference(poses[i].T_map_body, expected[i].T_map_body).norm(), 1e-9) << i;
  }
  EXPECT_EQ(some.smoother.stats().loops_kept, all.smoother.stats().loops_kept) << "those that went count as kept";
  EXPECT_TRUE(some.last.covariance.isApprox(all.last.covariance, 1e-6));
}

TEST(KeyframeThinning, LoopsAreFoundAsBefore) {
  const testing::Drive drive = testing::make_drive({.seed = 2, .keyframes = 110, .cloud_points = 3000});
  const auto loops = [&](double spacing_m) {
    BackendConfig config = without_search(40, spacing_m);
    config.use_loop_closing = true;
    Smoother smoother(config, LoopGates());
    for (const Keyframe& keyframe : drive.keyframes) EXPECT_TRUE(smoother.add_keyframe(keyframe).accepted());
    EXPECT_EQ(smoother.stats().absorbed > 20, spacing_m > 0.0);
    return smoother.stats().loops_kept;
  };
  const int before = loops(0.0);
  EXPECT_GT(before, 25);
  EXPECT_NEAR(loops(kSpacing), before, 2);
}

TEST(KeyframeThinning, WhatWasLinkedAcrossAGapIsAsVagueAsTheWay) {
  const PoseGraph graph = thinned(150).smoother.pose_graph();
  std::size_t across = 0;
  for (std::size_t i = 0; i + 1 < graph.vertices.size(); ++i) {
    const PoseGraphEdge& edge = graph.edges[i];
    ASSERT_FALSE(edge.is_loop);
    EXPECT_EQ(edge.from, graph.vertices[i].id);
    EXPECT_EQ(edge.to, graph.vertices[i + 1].id);
    const Matrix6d covariance = edge.information.inverse();
    const double steps = edge.to - edge.from;
    across += steps > 1 ? 1 : 0;
    // Attitude errors of the steps add up in all axes alike.
    EXPECT_NEAR(covariance(1, 1) / graph.edges[0].information.inverse()(1, 1), steps, 0.2 * steps) << i;
  }
  EXPECT_GE(across, 1U);
}

TEST(KeyframeThinning, AnotherDriveIsToldByWhatWasAbsorbed) {
  const Laps laps = thinned(150);
  for (std::int32_t id = 0; id < 150; ++id) {
    Keyframe keyframe = laps.drive.keyframes[static_cast<std::size_t>(id)];
    EXPECT_FALSE(laps.smoother.is_of_another_drive(keyframe)) << id << " came once more";
    keyframe.state.utime += 3'600'000'000;
    EXPECT_TRUE(laps.smoother.is_of_another_drive(keyframe)) << id << " of a front end that began anew";
  }
}

TEST(KeyframeThinning, ALoopThatWentWithAKeyframeStaysAndSaysSo) {
  Laps laps = thinned(150);
  const int loops = laps.smoother.stats().loops_kept;
  const SmootherUpdate update = laps.smoother.withdraw_loop(24, 24 % kLap);
  ASSERT_TRUE(update.loop);
  EXPECT_EQ(update.loop->stage, LoopStage::kKept);
  EXPECT_EQ(update.loop->utime, laps.drive.keyframes.back().state.utime);
  EXPECT_TRUE(testing::contains(update.loop->reason_text, "it stays"));
  EXPECT_EQ(laps.smoother.stats().loops_kept, loops);
}

TEST(KeyframeThinning, ALoopToOneThatWentIsRefusedWithTheReason) {
  Laps laps = thinned(150);
  const auto reason = [&](int from, int to) {
    const SmootherUpdate update = laps.smoother.add_loop(loop_in(laps.drive, from, to));
    EXPECT_FALSE(update.loop->accepted());
    return update.loop->reason_text;
  };
  EXPECT_TRUE(testing::contains(reason(149, 25), "another stands for it"));
  EXPECT_TRUE(testing::contains(reason(46, 25), "have retired"));
  EXPECT_TRUE(testing::contains(reason(149, 4000), "does not hold"));
  EXPECT_TRUE(laps.smoother.add_loop(loop_in(laps.drive, 149, 149 % kLap)).loop->accepted());
}

TEST(KeyframeThinning, ABatchSolutionFromBeforeItIsStillTaken) {
  Laps laps = thinned(110);
  const ShadowOptimum optimum = solve(laps.smoother.shadow_problem());
  ASSERT_TRUE(optimum.solved);
  const SmootherStats before = laps.smoother.stats();
  const std::int32_t first_estimated = before.retired;
  const testing::Drive more = testing::make_drive({.seed = 3, .keyframes = 135});
  for (int id = 110; id < 135; ++id) {
    EXPECT_TRUE(laps.smoother.add_keyframe(more.keyframes[static_cast<std::size_t>(id)]).accepted());
    if (id % 3 == 0) static_cast<void>(laps.smoother.add_loop(loop_in(more, id, id % kLap)));
  }
  const std::vector<KeyframePose> left = laps.smoother.pose_graph().vertices;
  ASSERT_FALSE(std::ranges::contains(left, first_estimated + 1, &KeyframePose::id)) << "absorbed since";
  static_cast<void>(laps.smoother.adopt(optimum));
  EXPECT_EQ(laps.smoother.stats().shadow_checks, 1);
}

/// Twenty keyframes by hand, of which the first `recorded` are in a journal.
struct Passes {
  explicit Passes(std::int32_t recorded = 0) {
    for (std::int32_t id = 0; id < 20; ++id) {
      if (id == recorded && recorded > 0) state.clouds.note_record(0);
      state.nodes.emplace_back().end.id = id;
      state.poses.push_back({id, {Eigen::Quaterniond::Identity(), {10.0 * id, 0.0, 0.0}}});
      state.clouds.add(id, {});
    }
  }
  /// Puts one where another is, and a little beside it.
  void put(std::size_t place, std::size_t where, const Eigen::Vector3d& beside, double turn = 0.0) {
    state.poses[place].T_map_body = state.poses[where].T_map_body;
    state.poses[place].T_map_body.translation += beside;
    state.poses[place].T_map_body.rotation = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY());
  }
  [[nodiscard]] std::vector<std::size_t> found(std::size_t until = 19, double spacing_m = kSpacing) const {
    BackendConfig config;
    config.retired_spacing_m = spacing_m;
    return places_to_absorb(until, config, state);
  }
  SmootherState state;
};

using Places = std::vector<std::size_t>;

TEST(KeyframeThinning, AbsorbsTheLaterOneOfTheSamePlaceAndHeading) {
  Passes passes;
  passes.put(12, 1, {1.9, 0.0, 0.0}, 0.7);
  EXPECT_EQ(passes.found(), Places{12});
  EXPECT_EQ(passes.found(12), Places{}) << "it has not retired";
  EXPECT_EQ(passes.found(19, 1.0), Places{}) << "too far off";
  EXPECT_EQ(passes.found(19, 0.0), Places{}) << "all are kept";
}

TEST(KeyframeThinning, KeepsAnotherFloorAnotherHeadingAndTheSamePass) {
  Passes passes;
  passes.put(12, 1, {0.0, 3.0, 0.0});
  passes.put(13, 2, {0.5, 0.0, 0.0}, std::numbers::pi);
  passes.put(14, 13, {0.5, 0.0, 0.0}, std::numbers::pi);
  passes.put(17, 8, {0.5, 0.0, 0.0});
  EXPECT_EQ(passes.found(), Places{}) << "nine keyframes are one pass";
  passes.put(18, 8, {0.5, 0.0, 0.0});
  EXPECT_EQ(passes.found(), Places{18}) << "ten are not";
}

TEST(KeyframeThinning, WhatIsAbsorbedStandsForNothing) {
  Passes passes;
  passes.put(1, 0, {30.0, 0.0, 100.0});
  passes.put(12, 1, {1.5, 0.0, 0.0});
  passes.put(18, 1, {3.0, 0.0, 0.0});
  passes.put(19, 12, {3.0, 0.0, 0.0});
  EXPECT_EQ(passes.found(20), Places{12}) << "18 and 19 are 3 m and more from 1, which stays";
  passes.state.loops.emplace_back().result.to_id = 12;
  EXPECT_EQ(passes.found(20), Places{}) << "12 waits for its loop, and is absorbed thereafter";
}

TEST(KeyframeThinning, KeepsWhatLoopsEndAtAndWhatNoRecordHolds) {
  Passes passes;
  passes.put(12, 1, {0.5, 0.0, 0.0});
  passes.put(13, 2, {0.5, 0.0, 0.0});
  passes.put(14, 3, {0.5, 0.0, 0.0});
  passes.state.loops.emplace_back().result.to_id = 12;
  passes.state.waiting.emplace_back().result.from_id = 13;
  EXPECT_EQ(passes.found(), Places{14});
  Passes journalled(13);
  journalled.put(12, 1, {0.5, 0.0, 0.0});
  journalled.put(14, 3, {0.5, 0.0, 0.0});
  EXPECT_EQ(journalled.found(), Places{12});
}

/// A keyframe of the hall at its true place; what it saw may be `off` by so much.
void add_view(SmootherState& state, std::int32_t id, const Pose& T_map_body, const Eigen::Vector3d& off) {
  GraphNode node;
  node.end.id = id;
  node.end.filter.T_odom_body = T_map_body;
  node.odometry = 1e3 * Matrix6d::Identity();
  node.pose_covariance = 1e-6 * Matrix6d::Identity();
  state.nodes.push_back(node);
  state.poses.push_back({id, T_map_body});
  Pose seen_from = T_map_body;
  seen_from.translation += off;
  state.clouds.add(id, compact(testing::hall_cloud(seen_from, 3000, static_cast<unsigned>(id))));
}

TEST(KeyframeThinning, ALoopIsMatchedWithThePassOfItsPlaceAlone) {
  const testing::Drive drive = testing::make_drive({.keyframes = 2});
  const Eigen::Vector3d right = Eigen::Vector3d::Zero();
  SmootherState state;
  for (std::int32_t id = 0; id < 2; ++id) add_view(state, id, drive.T_world_body[static_cast<std::size_t>(id)], right);
  // Where keyframes were absorbed the next one is of another time, when the graph may have been somewhere else.
  state.absorbed.push_back({30, drive.T_world_body[0]});
  for (std::int32_t id = 50; id < 53; ++id) add_view(state, id, drive.T_world_body[0], {0.3, 0.0, 0.3});
  add_view(state, 80, drive.T_world_body[0], right);
  const BackendConfig config;
  follow_nodes(state, config);
  const LoopProposal proposal = search_loop(state, config, LoopGates());
  ASSERT_TRUE(proposal.verified()) << proposal.result.reason_text;
  EXPECT_EQ(proposal.result.to_id, 0);
  EXPECT_LT(proposal.result.T_to_from.translation.norm(), 0.01);
  EXPECT_LT(proposal.result.mean_residual, 0.02);
}

}  // namespace
}  // namespace ignis
