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
LiveMap driven_map(std::mt19937& generator) {
  LiveMap map(MapConfig{});
  for (int id = 0; id < 10; ++id) {
    const Pose pose = pose_at(2.0 * id, 0, 0);
    map.add_keyframe(keyframe(id, pose, random_cloud(generator, 100, 8, 3)));
    map.insert_scan(random_cloud(generator, 300, 8, 3), pose);
  }
  return map;
}

std::vector<CorrectedPose> shifted_keyframes(double shift_z) {
  std::vector<CorrectedPose> poses;
  for (int id = 0; id < 10; ++id) poses.push_back({id, pose_at(2.0 * id, 0, shift_z * id)});
  return poses;
}

void run_rebuild(LiveMap& map) { map.finish_rebuild(rebuild(map.begin_rebuild())); }

TEST(LiveMap, PlacesScansByTheCurrentCorrection) {
  LiveMap map(MapConfig{});
  map.correct(pose_at(100, 0, 50, 0.5), {});
  const CloudPoint point{{1.0F, 0.0F, -2.0F}, 9.0F};
  map.insert_scan(std::span(&point, 1), pose_at(3, 0, 4));
  const Eigen::Vector3d expected = pose_at(100, 0, 50, 0.5) * (pose_at(3, 0, 4) * Eigen::Vector3d(1, 0, -2));
  EXPECT_TRUE(map.voxels().level(0).contains(map.voxels().level(0).cell_of(expected)));
}

TEST(LiveMap, AsksForARebuildOnceAKeyframeMovedMoreThanTheThreshold) {
  std::mt19937 generator(1);
  LiveMap map = driven_map(generator);
  map.correct(Pose{}, shifted_keyframes(0.005));
  EXPECT_FALSE(map.needs_rebuild()) << "4.5 cm is below the threshold";
  map.correct(Pose{}, shifted_keyframes(0.006));
  EXPECT_TRUE(map.needs_rebuild());
  run_rebuild(map);
  EXPECT_FALSE(map.needs_rebuild());
  EXPECT_EQ(map.rebuilds(), 1);
}

TEST(LiveMap, RebuildsAfterAnAcceptedLoopAsSoonAsItsCorrectionIsIn) {
  std::mt19937 generator(2);
  LiveMap map = driven_map(generator);
  map.add_loop(9, 0);
  EXPECT_FALSE(map.needs_rebuild());
  map.correct(Pose{}, shifted_keyframes(0.001));
  EXPECT_TRUE(map.needs_rebuild());
  run_rebuild(map);
  EXPECT_FALSE(map.needs_rebuild());
}

TEST(LiveMap, ARebuiltMapEqualsOneFromAnotherHistoryWithTheSameKeyframes) {
  std::mt19937 generator(3);
  LiveMap map = driven_map(generator);
  LiveMap twice = map;
  map.correct(pose_at(0, 0, 0.9), shifted_keyframes(0.1));
  run_rebuild(map);
  twice.correct(pose_at(0, 0, 4.5), shifted_keyframes(0.5));
  const RebuildJob outdated = twice.begin_rebuild();
  twice.correct(pose_at(0, 0, 0.9), shifted_keyframes(0.1));
  EXPECT_FALSE(twice.needs_rebuild()) << "one rebuild at a time";
  twice.finish_rebuild(rebuild(outdated));
  EXPECT_TRUE(twice.needs_rebuild()) << "the second correction came during the rebuild";
  run_rebuild(twice);
  EXPECT_EQ(map.voxels().fingerprint(), twice.voxels().fingerprint());
}

TEST(LiveMap, ARebuildKeepsTheDetailOfTheLiveScans) {
  std::mt19937 generator(4);
  LiveMap map = driven_map(generator);
  const std::size_t before = map.voxels().size();
  map.add_loop(9, 0);
  map.correct(Pose{}, shifted_keyframes(0.0));
  run_rebuild(map);
  // All of what the scans showed, and the keyframes' own clouds on top.
  EXPECT_GT(map.voxels().size(), before);
}

TEST(LiveMap, ScansThatArriveDuringARebuildAreInTheNewMap) {
  std::mt19937 generator(5);
  LiveMap map = driven_map(generator);
  const RebuildJob job = map.begin_rebuild();
  const CloudPoint point{{0.0F, 4.5F, 0.0F}, 1.0F};
  map.insert_scan(std::span(&point, 1), pose_at(18, 0, 0));
  const VoxelLevel& local = map.voxels().level(0);
  const CellIndex cell = local.cell_of({18.0, 4.5, 0.0});
  EXPECT_TRUE(local.contains(cell)) << "the old map goes on while the new one is built";
  map.finish_rebuild(rebuild(job));
  EXPECT_TRUE(map.voxels().level(0).contains(cell));
}

TEST(LiveMap, VoxelsOfARebuiltMapCarryTheirKeyframe) {
  std::mt19937 generator(6);
  LiveMap map = driven_map(generator);
  run_rebuild(map);
  map.voxels().level(0).for_each([](const CellIndex&, const MapPoint& point) { EXPECT_GE(point.keyframe_id, 0); });
}

TEST(LiveMap, PathsAndLoopEdgesFollowTheCorrection) {
  std::mt19937 generator(7);
  LiveMap map = driven_map(generator);
  map.add_loop(9, 0);
  map.correct(pose_at(0, 0, 0.9), shifted_keyframes(0.1));
  const auto odometry = map.odometry_path();
  const auto corrected = map.corrected_path();
  ASSERT_EQ(odometry.size(), 10U);
  ASSERT_EQ(corrected.size(), 10U);
  EXPECT_FLOAT_EQ(odometry.back().z(), 0.0F);
  EXPECT_NEAR(corrected.back().z(), 0.9F, 1e-5);
  ASSERT_EQ(map.loop_edges().size(), 1U);
  EXPECT_NEAR(map.loop_edges()[0].first.z(), 0.9F, 1e-5);
  map.remove_loop(9, 0);
  EXPECT_TRUE(map.loop_edges().empty());
}

TEST(LiveMap, RefusesUnusablePosesAndCountsThem) {
  std::mt19937 generator(8);
  LiveMap map = driven_map(generator);
  const std::string before = map.voxels().fingerprint();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<CloudPoint> cloud = random_cloud(generator, 10, 5, 2);
  EXPECT_EQ(map.insert_scan(cloud, pose_at(nan, 0, 0)).rejected, 10U);
  EXPECT_FALSE(map.add_keyframe(keyframe(10, pose_at(1e7, 0, 0))));
  const CorrectedPose bad{3, pose_at(0, nan, 0)};
  map.correct(pose_at(1e9, 0, 0), std::span(&bad, 1));
  EXPECT_EQ(map.refused_poses(), 4);
  EXPECT_FALSE(map.needs_rebuild());
  EXPECT_EQ(map.voxels().fingerprint(), before);
}

TEST(LiveMap, NamesTheKeyframesThatNeverCame) {
  LiveMap map(MapConfig{});
  map.add_keyframe(keyframe(0, Pose{}));
  map.add_keyframe(keyframe(3, Pose{}));
  EXPECT_EQ(map.missing_keyframes(5), (std::vector<std::int32_t>{1, 2, 4}));
  EXPECT_EQ(map.missing_keyframes(3), (std::vector<std::int32_t>{1, 2}));
}

TEST(LiveMap, ClearForgetsTheDriveButNotTheCounts) {
  std::mt19937 generator(9);
  LiveMap map = driven_map(generator);
  run_rebuild(map);
  map.clear();
  EXPECT_EQ(map.voxels().size(), 0U);
  EXPECT_TRUE(map.odometry_path().empty());
  EXPECT_EQ(map.clouds().size(), 0U);
  EXPECT_EQ(map.rebuilds(), 1);
}

}  // namespace
}  // namespace ignis
