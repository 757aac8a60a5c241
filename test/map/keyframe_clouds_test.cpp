// SPDX-License-Identifier: Apache-2.0
#include "map/keyframe_clouds.h"

#include <limits>

#include <gtest/gtest.h>

#include "map/random_clouds.h"

namespace ignis {
namespace {

using test::pose_at;
using test::random_cloud;

constexpr double kCell = 0.125;

TEST(KeyframeClouds, KeepsLiveScansInTheFrameOfTheNewestKeyframe) {
  KeyframeClouds clouds(kCell, 1'000'000);
  const Pose T_odom_keyframe = pose_at(10, 0, 5, 0.5);
  clouds.add_keyframe(0, {}, T_odom_keyframe);
  const Pose T_odom_body = pose_at(11, 0.2, 4, 0.9);
  const CloudPoint point{{2.0F, 1.0F, -3.0F}, 42.0F};
  const KeyframeClouds::Kept kept = clouds.add_scan(std::span(&point, 1), T_odom_body);
  EXPECT_EQ(kept.id, 0);
  ASSERT_EQ(kept.points.size(), 1U);
  ASSERT_EQ(clouds.view(0).points.size(), 1U);
  const Eigen::Vector3d p_odom = T_odom_keyframe * Eigen::Vector3d(kept.points[0].position.cast<double>());
  EXPECT_LT((p_odom - T_odom_body * Eigen::Vector3d(2, 1, -3)).norm(), 1e-5);
  EXPECT_FLOAT_EQ(clouds.view(0).points[0].intensity, 42.0F);
}

TEST(KeyframeClouds, KeepsTheFirstPointOfACellAndSaysSo) {
  KeyframeClouds clouds(kCell, 1'000'000);
  const std::vector<CloudPoint> cloud = {{{0.01F, 0.0F, 0.0F}, 1.0F}};
  const std::vector<CloudPoint> scan = {{{0.06F, 0.06F, 0.06F}, 2.0F}, {{0.2F, 0.0F, 0.0F}, 3.0F}};
  EXPECT_EQ(clouds.add_keyframe(0, cloud, Pose{}).points.size(), 1U);
  const KeyframeClouds::Kept kept = clouds.add_scan(scan, Pose{});
  ASSERT_EQ(kept.points.size(), 1U) << "the first one's cell has its point";
  EXPECT_EQ(kept.points[0].intensity, 3.0F);
  EXPECT_TRUE(clouds.add_scan(scan, Pose{}).points.empty());
  clouds.add_keyframe(1, {}, Pose{});
  EXPECT_EQ(clouds.add_scan(scan, Pose{}).points.size(), 2U) << "a new keyframe starts with nothing";
}

TEST(KeyframeClouds, WhatIsSeenBeforeTheFirstKeyframeHasAStandIn) {
  KeyframeClouds clouds(kCell, 1'000'000);
  const CloudPoint point{{2.0F, 1.0F, -3.0F}, 42.0F};
  EXPECT_EQ(clouds.add_scan(std::span(&point, 1), pose_at(1, 2, 3)).id, KeyframeClouds::kBeforeFirst);
  EXPECT_EQ(clouds.open_id(), KeyframeClouds::kBeforeFirst);
  EXPECT_EQ(clouds.view(KeyframeClouds::kBeforeFirst).points[0].position, point.position);
  clouds.add_keyframe(0, {}, pose_at(4, 0, 0));
  EXPECT_EQ(clouds.open_id(), 0);
  EXPECT_EQ(clouds.view(KeyframeClouds::kBeforeFirst).points.size(), 1U);
}

TEST(KeyframeClouds, ClosingLosesAndAddsNothing) {
  std::mt19937 generator(1);
  KeyframeClouds clouds(kCell, 1'000'000);
  clouds.add_keyframe(0, random_cloud(generator, 500, 5, 2), pose_at(0, 0, 0));
  clouds.add_scan(random_cloud(generator, 500, 5, 2), pose_at(1, 0, 0));
  const auto as_set = [&] {
    std::vector<std::array<float, 4>> points;
    for (const CloudPoint& p : clouds.view(0).points) {
      points.push_back({p.position.x(), p.position.y(), p.position.z(), p.intensity});
    }
    std::ranges::sort(points);
    return points;
  };
  const auto open = as_set();
  EXPECT_GT(open.size(), 900U);
  clouds.add_keyframe(1, {}, pose_at(4, 0, 0));
  EXPECT_EQ(as_set(), open);
  clouds.add_scan(random_cloud(generator, 100, 5, 2), pose_at(5, 0, 0));
  EXPECT_EQ(as_set(), open);
  EXPECT_EQ(clouds.points(), open.size() + clouds.view(1).points.size());
}

TEST(KeyframeClouds, BlocksOfAClosedCloudHoldAllItsPointsEachWithinItsCube) {
  std::mt19937 generator(7);
  KeyframeClouds clouds(kCell, 1'000'000);
  clouds.add_keyframe(0, random_cloud(generator, 3'000, 15, 4), Pose{});
  EXPECT_TRUE(clouds.view(0).blocks.empty()) << "an open cloud is in no order";
  clouds.add_keyframe(1, {}, Pose{});
  const StoredCloud cloud = clouds.view(0);
  std::uint32_t next = 0;
  for (const CloudBlock& block : cloud.blocks) {
    EXPECT_EQ(block.begin, next);
    ASSERT_LT(block.begin, block.end);
    for (const CloudPoint& point : cloud.points.subspan(block.begin, block.end - block.begin)) {
      EXPECT_LE((point.position - block.centre).cwiseAbs().maxCoeff(), static_cast<float>(0.5 * CloudBlock::kEdge));
    }
    next = block.end;
  }
  EXPECT_EQ(next, cloud.points.size());
  EXPECT_GT(cloud.blocks.size(), 100U);
}

TEST(KeyframeClouds, ASharedCloudDoesNotChangeAnyMore) {
  std::mt19937 generator(2);
  KeyframeClouds clouds(kCell, 1'000'000);
  clouds.add_keyframe(0, random_cloud(generator, 50, 5, 2), Pose{});
  const auto shared = clouds.share(0);
  const std::size_t size = shared->points.size();
  clouds.add_scan(random_cloud(generator, 50, 5, 2), Pose{});
  EXPECT_EQ(shared->points.size(), size);
  EXPECT_GT(clouds.share(0)->points.size(), size);
}

TEST(KeyframeClouds, TakesAKeyframeThatComesLateAsItIs) {
  std::mt19937 generator(3);
  KeyframeClouds clouds(kCell, 1'000'000);
  clouds.add_keyframe(0, random_cloud(generator, 50, 5, 2), pose_at(0, 0, 0));
  clouds.add_keyframe(2, random_cloud(generator, 50, 5, 2), pose_at(8, 0, 0));
  EXPECT_EQ(clouds.add_keyframe(1, random_cloud(generator, 60, 5, 2), pose_at(4, 0, 0)).points.size(), 60U);
  EXPECT_EQ(clouds.view(1).points.size(), 60U);
  EXPECT_EQ(clouds.open_id(), 2);
}

TEST(KeyframeClouds, LeavesOutPointsThatNoMapCanHoldAndMendsIntensities) {
  KeyframeClouds clouds(kCell, 1'000'000);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<CloudPoint> cloud = {{{nan, 0.0F, 0.0F}, 1.0F},
                                         {{0.0F, 2e4F, 0.0F}, 1.0F},
                                         {{1.0F, 0.0F, 0.0F}, nan},
                                         {{2.0F, 0.0F, 0.0F}, 1e9F},
                                         {{3.0F, 0.0F, 0.0F}, -5.0F}};
  clouds.add_keyframe(0, cloud, Pose{});
  ASSERT_EQ(clouds.view(0).points.size(), 3U);
  EXPECT_EQ(clouds.view(0).points[0].intensity, 0.0F);
  EXPECT_EQ(clouds.view(0).points[1].intensity, 255.0F);
  EXPECT_EQ(clouds.view(0).points[2].intensity, 0.0F);
}

TEST(KeyframeClouds, LeavesOutWhatIsNoNumberWhicheverCoordinateAndHoweverLateItComes) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, infinity}) {
    for (int axis = 0; axis < 3; ++axis) {
      CloudPoint point{{1.0F, 2.0F, 3.0F}, 1.0F};
      point.position[axis] = bad;
      KeyframeClouds clouds(kCell, 1'000'000);
      clouds.add_keyframe(1, std::span(&point, 1), Pose{});
      clouds.add_scan(std::span(&point, 1), Pose{});
      clouds.add_keyframe(0, std::span(&point, 1), Pose{});  // late
      EXPECT_EQ(clouds.points(), 0U) << bad << " in axis " << axis;
    }
  }
}

TEST(KeyframeClouds, SaysWhatTheRaysOfItsScansFoundFree) {
  KeyframeClouds clouds(kCell, 1'000'000);
  clouds.follow_rays(FreeSpace(0.25, 3));
  const std::vector<CloudPoint> wall = {{{0.05F, 0.0F, -3.0F}, 1.0F}};
  clouds.add_keyframe(0, wall, Pose{});
  for (int i = 0; i < 3; ++i) clouds.add_scan(wall, Pose{});
  EXPECT_TRUE(clouds.view(0).free.empty()) << "not known before the keyframe is closed";
  clouds.add_keyframe(1, {}, Pose{});
  EXPECT_GT(clouds.view(0).free.size(), 8U);
  for (const FreeCell cell : clouds.view(0).free) EXPECT_GT(unpack_free_cell(cell).z, -11);
}

TEST(KeyframeClouds, DropsTheFarthestCloudWhenFull) {
  std::mt19937 generator(4);
  KeyframeClouds clouds(kCell, 1'000);
  std::vector<std::int32_t> dropped;
  for (int id = 0; id < 20; ++id) {
    clouds.add_keyframe(id, random_cloud(generator, 200, 9, 4), pose_at(4 * id, 0, 0));
    const auto now = clouds.beyond_bound();
    clouds.drop(now);
    dropped.insert(dropped.end(), now.begin(), now.end());
    ASSERT_LE(clouds.points(), 1'000U);
  }
  EXPECT_FALSE(clouds.contains(0));
  EXPECT_TRUE(clouds.contains(19));
  EXPECT_TRUE(clouds.contains(17));
  EXPECT_EQ(dropped.size() + clouds.size(), 20U);
  EXPECT_EQ(clouds.dropped(), std::ssize(dropped));
}

TEST(KeyframeClouds, MakesRoomForAWhileWhenFull) {
  std::mt19937 generator(6);
  KeyframeClouds clouds(kCell, 8'000);
  int drops = 0;
  std::int32_t id = 0;
  for (; id < 400; ++id) {
    clouds.add_keyframe(id, random_cloud(generator, 50, 9, 4), pose_at(id, 0, 0));
    const auto now = clouds.beyond_bound();
    if (now.empty()) continue;
    ++drops;
    clouds.drop(now);
    EXPECT_LE(clouds.points(), 7'500U);
    EXPECT_GT(clouds.points(), 7'400U) << "no more than a sixteenth and a cloud";
  }
  EXPECT_GT(drops, 10);
  EXPECT_LT(drops, 40) << "one in ten keyframes has no place";
}

TEST(KeyframeClouds, AnOpenKeyframeAloneStaysWithinTheBoundToo) {
  std::mt19937 generator(5);
  KeyframeClouds clouds(kCell, 1'000);
  for (int i = 0; i < 20; ++i) {
    clouds.add_scan(random_cloud(generator, 200, 9, 4), Pose{});
    EXPECT_TRUE(clouds.beyond_bound().empty()) << "the newest stays";
  }
  EXPECT_EQ(clouds.points(), 1'000U);
}

}  // namespace
}  // namespace ignis
