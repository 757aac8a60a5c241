// SPDX-License-Identifier: Apache-2.0
#include "map/live_map.h"

#include <limits>

#include <gtest/gtest.h>

#include "map/random_clouds.h"

namespace ignis {
namespace {

using test::pose_at;
using test::random_cloud;

Keyframe keyframe(std::int32_t id, const Pose& T_odom_body, std::vector<CloudPoint> cloud = {}) {
  Keyframe keyframe;
  keyframe.id = id;
  keyframe.state.T_odom_body = T_odom_body;
  keyframe.cloud = std::move(cloud);
  return keyframe;
}

/// Ten keyframes 2 m apart, with live scans around each.
void drive(LiveMap& map, std::uint32_t seed) {
  std::mt19937 generator(seed);
  for (int id = 0; id < 10; ++id) {
    const Pose pose = pose_at(2.0 * id, 0, 0);
    map.add_keyframe(keyframe(id, pose, random_cloud(generator, 100, 8, 3)));
    map.insert_scan(random_cloud(generator, 300, 8, 3), pose);
  }
}

std::vector<CorrectedPose> shifted_keyframes(double shift_z) {
  std::vector<CorrectedPose> poses;
  for (int id = 0; id < 10; ++id) poses.push_back({id, pose_at(2.0 * id, 0, shift_z * id)});
  return poses;
}

MapConfig rebuilding_aside() {
  MapConfig config;
  config.reanchor_points = 0;
  return config;
}

std::string fresh_fingerprint(const LiveMap& map) { return rebuild(map.as_drawn()).fingerprint(); }

void run_rebuild(LiveMap& map) { map.finish_rebuild(rebuild(map.begin_rebuild())); }

bool shows(const LiveMap& map, const Eigen::Vector3d& p) {
  return map.voxels().find(0, map.voxels().locator().cell_of(0, p)).has_value();
}

Keyframe stamped(std::int32_t id, Utime previous_utime, Utime utime, const Pose& T_odom_body = {}) {
  Keyframe made = keyframe(id, T_odom_body);
  made.previous_utime = previous_utime;
  made.state.utime = utime;
  return made;
}

TEST(LiveMap, TellsAKeyframeOfAnotherDriveByWhatItKnowsOfIdAndPredecessor) {
  LiveMap map(MapConfig{});
  map.add_keyframe(stamped(0, 100, 100));
  map.add_keyframe(stamped(1, 100, 200, pose_at(2, 0, 0)));
  map.correct(Pose{}, std::vector{CorrectedPose{3, pose_at(6, 0, 0)}});
  EXPECT_FALSE(map.is_of_another_drive(stamped(1, 100, 200, pose_at(2, 0, 0)))) << "sent again";
  EXPECT_FALSE(map.is_of_another_drive(stamped(2, 200, 300)));
  EXPECT_FALSE(map.is_of_another_drive(stamped(3, 300, 400))) << "only its corrected pose is known";
  EXPECT_FALSE(map.is_of_another_drive(stamped(9, 800, 900)));
  EXPECT_TRUE(map.is_of_another_drive(stamped(0, 101, 101)));
  EXPECT_TRUE(map.is_of_another_drive(stamped(1, 100, 200, pose_at(3, 0, 0)))) << "another odom";
  EXPECT_TRUE(map.is_of_another_drive(stamped(2, 201, 300)));
  map.clear();
  EXPECT_FALSE(map.is_of_another_drive(stamped(0, 101, 101)));
}

TEST(LiveMap, FindsNoPredecessorOfTheSmallestIds) {
  using Limits = std::numeric_limits<std::int32_t>;
  LiveMap map(MapConfig{});
  map.add_keyframe(stamped(Limits::max(), 100, 100));
  EXPECT_FALSE(map.is_of_another_drive(stamped(Limits::min(), 7, 8)));
  EXPECT_FALSE(map.is_of_another_drive(stamped(0, 7, 7)));
}

TEST(LiveMap, PlacesScansByTheCurrentCorrection) {
  LiveMap map(MapConfig{});
  map.correct(pose_at(100, 0, 50, 0.5), {});
  const CloudPoint point{{1.0F, 0.0F, -2.0F}, 9.0F};
  map.insert_scan(std::span(&point, 1), pose_at(3, 0, 4));
  EXPECT_TRUE(shows(map, pose_at(100, 0, 50, 0.5) * (pose_at(3, 0, 4) * Eigen::Vector3d(1, 0, -2))));
}

TEST(LiveMap, FollowsEveryCorrectionAtOnceWhenItIsSmall) {
  LiveMap map(MapConfig{});
  drive(map, 1);
  map.correct(Pose{}, shifted_keyframes(0.02), 7);
  EXPECT_FALSE(map.needs_rebuild());
  EXPECT_EQ(map.revision(), 7);
  EXPECT_EQ(map.reanchored(), 9) << "the first one stays";
  EXPECT_EQ(map.voxels().pose(9).translation.z(), 0.02 * 9);
  EXPECT_EQ(map.voxels().fingerprint(), fresh_fingerprint(map));
}

TEST(LiveMap, LeavesKeyframesWhoseCorrectionIsBelowTheThreshold) {
  LiveMap map(MapConfig{});
  drive(map, 1);
  map.correct(Pose{}, shifted_keyframes(0.0005));
  EXPECT_EQ(map.reanchored(), 0) << "4.5 mm at most";
  map.correct(Pose{}, shifted_keyframes(0.0006));
  EXPECT_EQ(map.reanchored(), 1) << "the ninth has 5.4 mm";
}

TEST(LiveMap, AsksForARebuildWhenACorrectionIsLarge) {
  LiveMap map(rebuilding_aside());
  drive(map, 2);
  const std::string before = map.voxels().fingerprint();
  map.correct(Pose{}, shifted_keyframes(0.1), 3);
  EXPECT_TRUE(map.needs_rebuild());
  EXPECT_EQ(map.voxels().fingerprint(), before);
  EXPECT_EQ(map.revision(), 0) << "the voxels stand on the old revision still";
  run_rebuild(map);
  EXPECT_FALSE(map.needs_rebuild());
  EXPECT_EQ(map.rebuilds(), 1);
  EXPECT_EQ(map.revision(), 3);
  EXPECT_NE(map.voxels().fingerprint(), before);
  EXPECT_EQ(map.voxels().fingerprint(), fresh_fingerprint(map));
}

/// One place seen from thirty keyframes, so that each tile is in many clouds.
void see_one_place_again_and_again(LiveMap& map) {
  std::mt19937 generator(7);
  for (int id = 0; id < 30; ++id) {
    const Pose pose = pose_at(0.1 * id, 0, 0);
    map.add_keyframe(keyframe(id, pose, random_cloud(generator, 500, 8, 3)));
    map.insert_scan(random_cloud(generator, 20, 8, 3), pose);
  }
}

TEST(LiveMap, LeavesItToARebuildToDropCloudsWhereManyOverlap) {
  MapConfig config;
  config.max_keyframe_points = 10'000;
  config.reanchor_points = 5'000;  // less than there is to be read again
  LiveMap map(config);
  see_one_place_again_and_again(map);
  EXPECT_TRUE(map.needs_rebuild());
  EXPECT_EQ(map.clouds().dropped(), 0) << "the map shows them still";
  EXPECT_EQ(map.voxels().fingerprint(), fresh_fingerprint(map));

  const RebuildJob job = map.begin_rebuild();
  map.insert_scan({}, pose_at(3, 0, 0));
  EXPECT_EQ(map.clouds().dropped(), 0) << "nor while it is built";
  map.finish_rebuild(rebuild(job));
  EXPECT_GT(map.clouds().dropped(), 0);
  EXPECT_LE(map.clouds().points(), 10'000U);
  EXPECT_FALSE(map.needs_rebuild());
  EXPECT_FALSE(map.voxels().contains(0)) << "the farthest cloud";
  EXPECT_EQ(map.voxels().fingerprint(), fresh_fingerprint(map));
}

TEST(LiveMap, DropsCloudsAtOnceWhereThatIsLittleWork) {
  MapConfig config;
  config.max_keyframe_points = 10'000;
  LiveMap map(config);
  see_one_place_again_and_again(map);
  EXPECT_FALSE(map.needs_rebuild());
  EXPECT_GT(map.clouds().dropped(), 0);
  EXPECT_LE(map.clouds().points(), 10'000U);
  EXPECT_EQ(map.voxels().fingerprint(), fresh_fingerprint(map));
}

TEST(LiveMap, TheWayToAMapDoesNotMatter) {
  LiveMap at_once(MapConfig{});
  LiveMap aside(rebuilding_aside());
  drive(at_once, 3);
  drive(aside, 3);
  at_once.correct(pose_at(0, 0, 0.9), shifted_keyframes(0.1));
  aside.correct(pose_at(0, 0, 4.5), shifted_keyframes(0.5));
  const RebuildJob outdated = aside.begin_rebuild();
  aside.correct(pose_at(0, 0, 0.9), shifted_keyframes(0.1));
  EXPECT_FALSE(aside.needs_rebuild()) << "one rebuild at a time";
  aside.finish_rebuild(rebuild(outdated));
  EXPECT_TRUE(aside.needs_rebuild()) << "the second correction came during the rebuild";
  run_rebuild(aside);
  const std::vector<CloudPoint> nothing;
  at_once.insert_scan(nothing, pose_at(18, 0, 0));
  aside.insert_scan(nothing, pose_at(18, 0, 0));
  EXPECT_EQ(at_once.voxels().fingerprint(), aside.voxels().fingerprint());
}

TEST(LiveMap, ScansThatArriveDuringARebuildAreInBothMaps) {
  LiveMap map(rebuilding_aside());
  drive(map, 5);
  const RebuildJob job = map.begin_rebuild();
  const CloudPoint point{{0.0F, 4.5F, 0.0F}, 1.0F};
  map.insert_scan(std::span(&point, 1), pose_at(18, 0, 0));
  EXPECT_TRUE(shows(map, {18.0, 4.5, 0.0})) << "the old map goes on while the new one is built";
  map.add_keyframe(keyframe(10, pose_at(20, 0, 0)));
  map.insert_scan(std::span(&point, 1), pose_at(20, 0, 0));
  map.finish_rebuild(rebuild(job));
  EXPECT_TRUE(shows(map, {18.0, 4.5, 0.0}));
  EXPECT_TRUE(shows(map, {20.0, 4.5, 0.0}));
  EXPECT_EQ(map.voxels().fingerprint(), fresh_fingerprint(map));
}

TEST(LiveMap, WhatCameBeforeTheFirstKeyframeMovesWithIt) {
  LiveMap map(MapConfig{});
  const CloudPoint point{{0.0F, 1.0F, -2.0F}, 1.0F};
  map.insert_scan(std::span(&point, 1), pose_at(0, 0, 0));
  EXPECT_TRUE(shows(map, {0, 1, -2})) << "shown at once";
  map.add_keyframe(keyframe(0, pose_at(1, 0, 0)));
  const CorrectedPose moved{0, pose_at(1, 0, 3)};
  map.correct(pose_at(0, 0, 3), std::span(&moved, 1));
  EXPECT_TRUE(shows(map, {0, 1, 1}));
  EXPECT_FALSE(shows(map, {0, 1, -2}));
}

TEST(LiveMap, ACorrectionThatCameBeforeItsKeyframeTakesTheStandInAlong) {
  LiveMap map(MapConfig{});
  const CloudPoint point{{0.0F, 1.0F, -2.0F}, 1.0F};
  map.insert_scan(std::span(&point, 1), pose_at(0, 0, 0));
  const CorrectedPose corrected{0, pose_at(1, 0, 3)};
  map.correct(Pose{}, std::span(&corrected, 1));
  map.add_keyframe(keyframe(0, pose_at(1, 0, 0)));
  EXPECT_TRUE(shows(map, {0, 1, 1}));
  EXPECT_FALSE(shows(map, {0, 1, -2}));
}

TEST(LiveMap, OnlyTheNewestKeyframeIsOpen) {
  LiveMap map(MapConfig{});
  drive(map, 6);
  EXPECT_EQ(map.voxels().open_cloud(), 9);
  map.add_keyframe(keyframe(10, pose_at(20, 0, 0)));
  EXPECT_EQ(map.voxels().open_cloud(), 10);
}

TEST(LiveMap, PathsLoopEdgesAndKeyframesFollowTheCorrection) {
  LiveMap map(MapConfig{});
  drive(map, 7);
  map.add_loop(9, 0);
  map.correct(pose_at(0, 0, 0.9), shifted_keyframes(0.1));
  const auto odometry = map.odometry_path();
  const auto corrected = map.corrected_path();
  ASSERT_EQ(odometry.size(), 10U);
  ASSERT_EQ(corrected.size(), 10U);
  EXPECT_FLOAT_EQ(odometry.back().z(), 0.0F);
  EXPECT_NEAR(corrected.back().z(), 0.9F, 1e-5);
  ASSERT_EQ(map.loop_edges().size(), 1U);
  EXPECT_NEAR(map.loop_edges()[0].from.z(), 0.9F, 1e-5);
  EXPECT_EQ(map.loop_edges()[0].from_id, 9);
  ASSERT_EQ(map.keyframe_positions().size(), 10U);
  EXPECT_NEAR(map.keyframe_positions()[9].second.z(), 0.9F, 1e-5);
  map.remove_loop(9, 0);
  EXPECT_TRUE(map.loop_edges().empty());
}

TEST(LiveMap, GivesTheCloudOfAKeyframeWhereItBelongs) {
  LiveMap map(MapConfig{});
  const std::vector<CloudPoint> cloud = {{{1.0F, 0.0F, 0.0F}, 1.0F}};
  map.add_keyframe(keyframe(0, pose_at(5, 0, 0), cloud));
  const CorrectedPose moved{0, pose_at(5, 0, 2)};
  map.correct(Pose{}, std::span(&moved, 1));
  ASSERT_EQ(map.placed_cloud(0).size(), 1U);
  EXPECT_LT((map.placed_cloud(0)[0] - Eigen::Vector3f(6, 0, 2)).norm(), 1e-5F);
  EXPECT_TRUE(map.placed_cloud(1).empty());
  EXPECT_TRUE(map.placed_cloud(-1).empty());
}

TEST(LiveMap, RefusesUnusablePosesAndCountsThem) {
  LiveMap map(MapConfig{});
  drive(map, 8);
  std::mt19937 generator(8);
  const std::string before = map.voxels().fingerprint();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<CloudPoint> cloud = random_cloud(generator, 10, 5, 2);
  EXPECT_EQ(map.insert_scan(cloud, pose_at(nan, 0, 0)).rejected, 10U);
  EXPECT_FALSE(map.add_keyframe(keyframe(10, pose_at(1e7, 0, 0))));
  EXPECT_FALSE(map.add_keyframe(keyframe(-1, pose_at(0, 0, 0))));
  const CorrectedPose bad[] = {{3, pose_at(0, nan, 0)}, {-1, pose_at(0, 0, 0)}};
  map.correct(pose_at(1e9, 0, 0), bad);
  EXPECT_EQ(map.refused_poses(), 6);
  EXPECT_FALSE(map.needs_rebuild());
  EXPECT_EQ(map.voxels().fingerprint(), before);
}

TEST(LiveMap, RefusesPointsThatNoMapCanHoldAndCountsThem) {
  LiveMap map(MapConfig{});
  drive(map, 9);
  std::mt19937 generator(9);
  std::vector<CloudPoint> cloud = random_cloud(generator, 10, 5, 2);
  cloud[2].position.y() = std::numeric_limits<float>::quiet_NaN();
  cloud[7].position.x() = 1e30F;
  const InsertCounts counts = map.insert_scan(cloud, pose_at(18, 0, 0));
  EXPECT_EQ(counts.rejected, 2U);
  EXPECT_EQ(counts.inserted + counts.outside + counts.known, 8U);
  EXPECT_TRUE(map.add_keyframe(keyframe(10, pose_at(20, 0, 0), cloud)));
  EXPECT_TRUE(map.add_keyframe(keyframe(12, pose_at(24, 0, 0))));
  EXPECT_TRUE(map.add_keyframe(keyframe(11, pose_at(22, 0, 0), cloud))) << "late";
  EXPECT_EQ(map.refused_points(), 6);
  EXPECT_EQ(map.refused_poses(), 0);
  const std::string before = map.voxels().fingerprint();
  for (CloudPoint& point : cloud) point.position.z() = std::numeric_limits<float>::infinity();
  EXPECT_EQ(map.insert_scan(cloud, pose_at(18, 0, 0)).rejected, 10U);
  EXPECT_EQ(map.voxels().fingerprint(), before);
}

TEST(LiveMap, NamesTheKeyframesThatNeverCame) {
  LiveMap map(MapConfig{});
  map.add_keyframe(keyframe(0, Pose{}));
  map.add_keyframe(keyframe(3, Pose{}));
  const auto all = [](std::int32_t) { return true; };
  EXPECT_EQ(map.missing_keyframes(5, 10, all), (std::vector<std::int32_t>{1, 2, 4}));
  EXPECT_EQ(map.missing_keyframes(3, 10, all), (std::vector<std::int32_t>{1, 2}));
  EXPECT_EQ(map.missing_keyframes(5, 10, [](std::int32_t id) { return id != 1; }), (std::vector<std::int32_t>{2, 4}));
}

TEST(Fault_B5, AnAbsurdNumberOfKeyframesMakesNoAbsurdList) {
  LiveMap map(MapConfig{});
  const auto missing = map.missing_keyframes(std::numeric_limits<std::int32_t>::max(), 3, [](auto) { return true; });
  EXPECT_EQ(missing, (std::vector<std::int32_t>{0, 1, 2}));
}

TEST(LiveMap, ClearForgetsTheDriveButNotTheCounts) {
  LiveMap map(MapConfig{});
  drive(map, 9);
  run_rebuild(map);
  map.clear();
  EXPECT_EQ(map.voxels().size(), 0U);
  EXPECT_TRUE(map.odometry_path().empty());
  EXPECT_EQ(map.clouds().size(), 0U);
  EXPECT_EQ(map.rebuilds(), 1);
}

}  // namespace
}  // namespace ignis
