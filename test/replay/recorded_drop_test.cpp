// SPDX-License-Identifier: Apache-2.0
#include "recorded_drop.h"

#include <gtest/gtest.h>

namespace ignis {
namespace {

health_t health(const std::string& process, const std::string& channel, std::int64_t lost, std::int64_t queue_drops) {
  health_t message{};
  message.utime = 7'000'000;
  message.process = process;
  message.num_receivers = 1;
  message.channels = {channel};
  message.received = {1000};
  message.lost = {lost};
  message.rejected = {0};
  message.queue_drops = {queue_drops};
  return message;
}

TEST(RecordedDrop, IsWhatTheFrontEndMissedOfTheSensors) {
  const std::optional<RecordedDrop> lost = drop_of(health("lio_frontend", "L1_IMU", 3, 1));
  ASSERT_TRUE(lost);
  EXPECT_EQ(lost->utime, 7'000'000);
  EXPECT_NE(lost->what.find("4 messages of L1_IMU"), std::string::npos) << lost->what;
  EXPECT_TRUE(drop_of(health("lio_frontend", "L1_SCAN", 0, 2)));
}

TEST(RecordedDrop, IsNoLossThatOthersMend) {
  EXPECT_FALSE(drop_of(health("lio_frontend", "L1_IMU", 0, 0)));
  EXPECT_FALSE(drop_of(health("graph_backend", "L1_IMU", 3, 0)));
  EXPECT_FALSE(drop_of(health("lio_frontend", "KEYFRAME_REQUEST", 3, 0)));
}

TEST(RecordedDrop, OfTwoTheEarlierCounts) {
  const RecordedDrop first{10, "a"};
  const RecordedDrop second{20, "b"};
  EXPECT_EQ(earlier(second, first)->what, "a");
  EXPECT_EQ(earlier(first, second)->what, "a");
  EXPECT_EQ(earlier(std::nullopt, second)->what, "b");
  EXPECT_EQ(earlier(first, std::nullopt)->what, "a");
  EXPECT_FALSE(earlier(std::nullopt, std::nullopt));
}

}  // namespace
}  // namespace ignis
