// SPDX-License-Identifier: Apache-2.0
#include "map/keyframe_clouds.h"

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
  clouds.add_scan(std::span(&point, 1), T_odom_body);
  const auto cloud = clouds.cloud(0);
  ASSERT_EQ(cloud->size(), 1U);
  const Eigen::Vector3d p_odom = T_odom_keyframe * Eigen::Vector3d(cloud->front().position.cast<double>());
  EXPECT_LT((p_odom - T_odom_body * Eigen::Vector3d(2, 1, -3)).norm(), 1e-5);
  EXPECT_FLOAT_EQ(cloud->front().intensity, 42.0F);
}

TEST(KeyframeClouds, ClosesAKeyframeWhenTheNextOneStarts) {
  std::mt19937 generator(1);
  KeyframeClouds clouds(kCell, 1'000'000);
  clouds.add_keyframe(0, random_cloud(generator, 100, 5, 2), pose_at(0, 0, 0));
  clouds.add_scan(random_cloud(generator, 100, 5, 2), pose_at(1, 0, 0));
  clouds.add_keyframe(1, {}, pose_at(4, 0, 0));
  const std::size_t first = clouds.cloud(0)->size();
  EXPECT_GT(first, 150U);
  clouds.add_scan(random_cloud(generator, 100, 5, 2), pose_at(5, 0, 0));
  EXPECT_EQ(clouds.cloud(0)->size(), first);
  EXPECT_GT(clouds.cloud(1)->size(), 90U);
  EXPECT_EQ(clouds.points(), first + clouds.cloud(1)->size());
}

TEST(KeyframeClouds, IgnoresAKeyframeThatComesTwiceAndTakesALateOne) {
  std::mt19937 generator(2);
  KeyframeClouds clouds(kCell, 1'000'000);
  clouds.add_keyframe(0, random_cloud(generator, 50, 5, 2), pose_at(0, 0, 0));
  clouds.add_keyframe(2, random_cloud(generator, 50, 5, 2), pose_at(8, 0, 0));
  const auto before = *clouds.cloud(0);
  clouds.add_keyframe(0, random_cloud(generator, 70, 5, 2), pose_at(0, 0, 0));
  EXPECT_EQ(clouds.cloud(0)->size(), before.size());
  clouds.add_keyframe(1, random_cloud(generator, 60, 5, 2), pose_at(4, 0, 0));
  EXPECT_EQ(clouds.cloud(1)->size(), 60U);
  EXPECT_EQ(clouds.size(), 3U);
}

TEST(KeyframeClouds, DropsTheFarthestCloudWhenFull) {
  std::mt19937 generator(3);
  KeyframeClouds clouds(kCell, 1'000);
  for (int id = 0; id < 20; ++id) {
    clouds.add_keyframe(id, random_cloud(generator, 200, 9, 4), pose_at(4 * id, 0, 0));
    ASSERT_LE(clouds.points(), 1'000U);
  }
  EXPECT_FALSE(clouds.contains(0));
  EXPECT_TRUE(clouds.cloud(0)->empty());
  EXPECT_TRUE(clouds.contains(19));
  EXPECT_TRUE(clouds.contains(17));
  EXPECT_EQ(clouds.dropped(), 20 - static_cast<std::int64_t>(clouds.size()));
}

}  // namespace
}  // namespace ignis
