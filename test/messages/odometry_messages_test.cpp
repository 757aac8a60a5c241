// SPDX-License-Identifier: Apache-2.0
#include "messages/odometry_messages.h"

#include <gtest/gtest.h>

#include "common/frames.h"
#include "common/so3.h"

namespace ignis::messages {
namespace {

NavState turned_left_and_driving() {
  NavState state;
  state.utime = 123;
  state.T_odom_body = {frames::from_yaw_pitch_roll({.yaw = 0.5, .pitch = 0.1, .roll = -0.2}), {1.0, 2.0, 3.0}};
  state.v_odom = state.T_odom_body.rotation * Eigen::Vector3d(0.1, 0.2, -1.5);
  state.gyro_bias = {0.01, 0.02, 0.03};
  state.accel_bias = {0.1, 0.2, 0.3};
  state.angular_rate = {0.0, 0.4, 0.0};
  return state;
}

TEST(StateMessages, SurviveTheRoundTripAndReadWellInSpy) {
  const NavState state = turned_left_and_driving();
  const Matrix15d covariance = Matrix15d::Random();
  const state_t message = to_message(state, 4, "odom", &covariance);
  EXPECT_NEAR(message.yaw, 0.5, 1e-12);
  EXPECT_NEAR(message.pitch, 0.1, 1e-12);
  EXPECT_NEAR(message.roll, -0.2, 1e-12);
  EXPECT_NEAR(message.velocity_forward, 1.5, 1e-12);
  EXPECT_EQ(message.session, 4);
  EXPECT_EQ(message.frame, "odom");
  EXPECT_EQ(message.covariance_valid, 1);
  EXPECT_EQ(message.covariance[15 * 2 + 7], covariance(2, 7));
  const NavState back = from_message(message);
  EXPECT_EQ(back.utime, 123);
  EXPECT_EQ(body_difference(back.T_odom_body, state.T_odom_body).norm(), 0.0);
  EXPECT_EQ(back.v_odom, state.v_odom);
  EXPECT_EQ(back.gyro_bias, state.gyro_bias);
  EXPECT_EQ(back.accel_bias, state.accel_bias);
  EXPECT_EQ(back.angular_rate, state.angular_rate);
}

TEST(StateMessages, CarryNoCovarianceBetweenScans) {
  const state_t message = to_message(turned_left_and_driving(), 0, "odom");
  EXPECT_EQ(message.covariance_valid, 0);
  EXPECT_EQ(message.num_covariance, 0);
}

TEST(ScanStatsMessages, SurviveTheRoundTripWithTheirReasonInWords) {
  ScanStats stats;
  stats.utime = 9;
  stats.scan_sequence = 8;
  stats.reason = ScanReason::kCorrectionTooLarge;
  stats.points = 900;
  stats.matched = 700;
  stats.used = 650;
  stats.mean_innovation = 0.012;
  stats.correction_m = 0.2;
  stats.observability = {0.2, 0.7, 0.1};
  stats.degenerate_directions = 1;
  stats.map_points = 12345;
  const scan_stats_t message = to_message(stats);
  EXPECT_EQ(message.applied, 0);
  EXPECT_EQ(message.reason, scan_stats_t::CORRECTION_TOO_LARGE);
  EXPECT_EQ(message.reason_text, text(ScanReason::kCorrectionTooLarge));
  const ScanStats back = from_message(message);
  EXPECT_EQ(back.reason, stats.reason);
  EXPECT_EQ(back.scan_sequence, 8);
  EXPECT_EQ(back.points, 900);
  EXPECT_EQ(back.used, 650);
  EXPECT_EQ(back.correction_m, 0.2);
  EXPECT_EQ(back.observability, stats.observability);
  EXPECT_EQ(back.degenerate_directions, 1);
  EXPECT_EQ(back.map_points, 12345);
}

TEST(CloudMessages, ComeTogetherAgainFromTheirParts) {
  PosedCloud cloud{.utime = 5, .sequence = 6, .session = 1, .applied = true, .T_odom_body = {}, .points = {}};
  cloud.T_odom_body.translation = {1.0, 0.0, 0.0};
  for (int i = 0; i < 7000; ++i) {
    cloud.points.push_back({.position = {static_cast<float>(i), 0.0F, 1.0F}, .intensity = 9.0F});
  }
  CloudAssembler assembler;
  std::optional<PosedCloud> back;
  for (const cloud_t& part : to_messages(cloud)) {
    EXPECT_LE(part.getEncodedSize(), 64'000);
    back = assembler.add(part);
  }
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->applied);
  EXPECT_EQ(back->T_odom_body.translation.x(), 1.0);
  ASSERT_EQ(back->points.size(), 7000U);
  EXPECT_EQ(back->points[6999].position.x(), 6999.0F);
}

}  // namespace
}  // namespace ignis::messages
