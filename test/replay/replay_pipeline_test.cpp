// SPDX-License-Identifier: Apache-2.0
#include "replay_pipeline.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "frontend/lio_runner.h"

namespace ignis {
namespace {

/// 16 s through the hall, the first two at rest.
test::Drive hall_drive() {
  return test::simulate(test::furnished_hall(), test::ellipse_drive(2.0, 6.0, 4.0, 1.0), 16.0, test::Sensors{}, 7);
}

ReplayResult replay(const test::Drive& drive) {
  ReplayPipeline pipeline({}, true);
  auto imu = drive.imu.begin();
  for (const Scan& scan : drive.scans) {
    for (; imu != drive.imu.end() && imu->utime <= scan.end_utime(); ++imu) pipeline.add_imu(*imu);
    pipeline.add_scan(scan);
  }
  for (; imu != drive.imu.end(); ++imu) pipeline.add_imu(*imu);
  return pipeline.finish();
}

TEST(ReplayPipeline, BeginsANewGraphWithTheFrontEndsNewSession) {
  // From one scan on all ranges are 6 % too long: nothing fits the old map, but the new scans fit one another.
  test::Drive drive = hall_drive();
  for (std::size_t i = 160; i < drive.scans.size(); ++i) {
    for (ScanPoint& point : drive.scans[i].points) point.position *= 1.06F;
  }
  const ReplayResult result = replay(drive);
  ASSERT_EQ(result.sessions, 2);
  const auto begin = std::ranges::find(result.scans, 1, &ScanStats::session);
  ASSERT_NE(begin, result.scans.end());
  EXPECT_GE(result.smoother.keyframes, 2) << "of the new session";
  EXPECT_EQ(result.graph.vertices.size(), static_cast<std::size_t>(result.smoother.keyframes));
  EXPECT_EQ(result.graph.vertices.front().id, 0);
  EXPECT_EQ(result.smoother.duplicates, 0);
  // The trajectories go on through the change, each stamp once.
  ASSERT_EQ(result.smoothed.size(), result.odometry.size());
  for (std::size_t i = 0; i < result.odometry.size(); ++i) {
    EXPECT_EQ(result.smoothed[i].utime, result.odometry[i].utime);
    EXPECT_LT(body_difference(result.smoothed[i].T_world_body, result.odometry[i].T_world_body).tail<3>().norm(), 0.5);
  }
}

TEST(ReplayPipeline, HasOneSessionWhereTheMapHolds) {
  const ReplayResult result = replay(hall_drive());
  EXPECT_EQ(result.sessions, 1);
  EXPECT_GE(result.smoother.keyframes, 4);
  EXPECT_EQ(result.smoothed.size(), result.odometry.size());
}

}  // namespace
}  // namespace ignis
