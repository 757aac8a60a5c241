// SPDX-License-Identifier: Apache-2.0
#include "messages/length_check.h"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace ignis::messages {
namespace {

template <class Message>
std::vector<std::byte> encoded(const Message& message) {
  std::vector<std::byte> data(static_cast<std::size_t>(message.getEncodedSize()));
  EXPECT_EQ(message.encode(data.data(), 0, static_cast<int>(data.size())), static_cast<int>(data.size()));
  return data;
}

template <class Message>
void fill(Message&) {}

void fill(state_t& message) {
  message.frame = "odom";
  message.num_covariance = 225;
  message.covariance.assign(225, 1.0);
}
void fill(scan_t& message) {
  message.num_points = 3;
  message.x = message.y = message.z = message.intensity = {1.0F, 2.0F, 3.0F};
  message.dt_us = {1, 2, 3};
}
void fill(cloud_t& message) {
  message.num_points = 2;
  message.x = message.y = message.z = message.intensity = {1.0F, 2.0F};
}
void fill(keyframe_t& message) {
  message.num_imu = 2;
  message.imu_dt_us = {0, 4000};
  message.gyro_x = message.gyro_y = message.gyro_z = {0.1F, 0.2F};
  message.accel_x = message.accel_y = message.accel_z = {0.1F, 0.2F};
  message.num_points = 3;
  message.x = message.y = message.z = {1, 2, 3};
  message.intensity = {7, 8, 9};
}
void fill(graph_command_t& message) { message.sender = "somebody"; }
void fill(lio_command_t& message) { message.sender = "somebody"; }
void fill(keyframe_request_t& message) {
  message.sender = "graph_backend";
  message.num_ids = 2;
  message.ids = {4, 5};
}
void fill(smoothed_keyframes_t& message) {
  message.num_keyframes = 2;
  message.ids = {0, 1};
  message.px = message.py = message.pz = message.qw = message.qx = message.qy = message.qz = {0.5, 0.25};
}
void fill(health_t& message) {
  message.process = "x";
  message.num_receivers = 2;
  message.channels = {"L1_IMU", ""};
  message.received = message.lost = message.rejected = message.queue_drops = {1, 2};
}

template <class Message>
class LengthCheck : public testing::Test {};

using AllTypes = testing::Types<imu_t, scan_t, driver_status_t, state_t, scan_stats_t, cloud_t, keyframe_t,
                                graph_command_t, keyframe_request_t, lio_command_t, smoothed_keyframes_t, loop_result_t,
                                map_status_t, pose_t, health_t>;
TYPED_TEST_SUITE(LengthCheck, AllTypes);

TYPED_TEST(LengthCheck, AcceptsEveryMessageThatTheEncoderMakes) {
  TypeParam message{};
  fill(message);
  TypeParam decoded;
  EXPECT_TRUE(decode_checked(std::span<const std::byte>(encoded(message)), decoded));
  EXPECT_EQ(encoded(decoded), encoded(message));
}

TYPED_TEST(LengthCheck, RefusesEveryTruncationAndEveryTail) {
  TypeParam message{};
  fill(message);
  std::vector<std::byte> data = encoded(message);
  TypeParam decoded;
  for (std::size_t size = 0; size < data.size(); ++size) {
    ASSERT_FALSE(decode_checked(std::span<const std::byte>(data).first(size), decoded)) << "cut at " << size;
  }
  data.push_back(std::byte{0});
  EXPECT_FALSE(decode_checked(std::span<const std::byte>(data), decoded));
}

TYPED_TEST(LengthCheck, SurvivesEverySingleAlteredWord) {
  TypeParam message{};
  fill(message);
  const std::vector<std::byte> data = encoded(message);
  // Counts of -1, 2^31-1 and 2^30 are the ones that wrap or throw in a generated decoder.
  for (const std::uint32_t word : {0xffffffffU, 0x7fffffffU, 0x40000000U, 0U}) {
    for (std::size_t at = 8; at + 4 <= data.size(); ++at) {
      std::vector<std::byte> altered = data;
      for (int i = 0; i < 4; ++i) altered[at + i] = static_cast<std::byte>(word >> (24 - 8 * i));
      TypeParam decoded;
      ASSERT_NO_THROW((void)decode_checked(std::span<const std::byte>(altered), decoded)) << "word at " << at;
    }
  }
}

TEST(LengthCheckTypes, RefusesAnotherTypeOnTheChannel) {
  pose_t decoded;
  EXPECT_FALSE(decode_checked(std::span<const std::byte>(encoded(imu_t{})), decoded));
}

TEST(Fault_B5, StampsThatLeaveNoRoomForArithmeticAreRefused) {
  imu_t message{};
  imu_t decoded;
  EXPECT_TRUE(decode_checked(encoded(message), decoded));
  message.utime = std::numeric_limits<std::int64_t>::max();
  EXPECT_FALSE(decode_checked(encoded(message), decoded));
  keyframe_t keyframe{};
  keyframe.previous_utime = std::numeric_limits<std::int64_t>::min();
  keyframe_t decoded_keyframe;
  EXPECT_FALSE(decode_checked(encoded(keyframe), decoded_keyframe));
}

}  // namespace
}  // namespace ignis::messages
