// SPDX-License-Identifier: Apache-2.0
#include "map/driven_path.h"

#include <gtest/gtest.h>

namespace ignis {
namespace {

TEST(DrivenPath, KeepsItsSpacing) {
  DrivenPath path;
  for (int i = 0; i < 1000; ++i) path.add({0.01 * i, 0, 0}, -1);
  const auto points = path.odometry();
  EXPECT_NEAR(static_cast<double>(points.size()), 50.0, 1.0);
  for (std::size_t i = 1; i < points.size(); ++i) EXPECT_GE((points[i] - points[i - 1]).norm(), 0.199F);
}

TEST(DrivenPath, StaysBoundedOnAnEndlessDriveAndStillStartsAtTheStart) {
  DrivenPath path;
  for (int i = 0; i < 50'000; ++i) path.add({0.5 * i, 0, 0}, -1);
  EXPECT_LE(path.size(), DrivenPath::kMaxPoints);
  EXPECT_GE(path.size(), DrivenPath::kMaxPoints / 4);
  const auto points = path.odometry();
  EXPECT_EQ(points.front().x(), 0.0F);
  EXPECT_GT(points.back().x(), 24'900.0F);
  for (std::size_t i = 1; i < points.size(); ++i) EXPECT_GT(points[i].x(), points[i - 1].x());
}

TEST(DrivenPath, FollowsTheCorrectionOfEachPointsKeyframe) {
  DrivenPath path;
  for (int i = 0; i < 10; ++i) path.add({1.0 * i, 0, 0}, i / 5);
  const auto corrected = path.corrected([](std::int32_t id) { return Pose{.translation = {0, 0, 10.0 * id}}; });
  ASSERT_EQ(corrected.size(), 10U);
  for (int i = 0; i < 10; ++i) EXPECT_FLOAT_EQ(corrected[static_cast<std::size_t>(i)].z(), i < 5 ? 0.0F : 10.0F);
}

}  // namespace
}  // namespace ignis
