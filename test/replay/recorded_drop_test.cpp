// SPDX-License-Identifier: Apache-2.0
#include "recorded_drop.h"

#include <gtest/gtest.h>

#include <limits>

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
  const std::string lost = loss_in(health("lio_frontend", "L1_IMU", 3, 1));
  EXPECT_NE(lost.find("4 messages of L1_IMU"), std::string::npos) << lost;
  EXPECT_FALSE(loss_in(health("lio_frontend", "L1_SCAN", 0, 2)).empty());
}

TEST(RecordedDrop, IsNoLossThatOthersMend) {
  EXPECT_EQ(loss_in(health("lio_frontend", "L1_IMU", 0, 0)), "");
  EXPECT_EQ(loss_in(health("graph_backend", "L1_IMU", 3, 0)), "");
  EXPECT_EQ(loss_in(health("lio_frontend", "KEYFRAME_REQUEST", 3, 0)), "");
}

TEST(RecordedDrop, TakesAnyCountForOne) {
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(loss_in(health("lio_frontend", "L1_IMU", kLeast, kLeast)), "");
  EXPECT_NE(loss_in(health("lio_frontend", "L1_IMU", kMost, kMost)).find("missed 6148914691236517204"),
            std::string::npos);
  EXPECT_NE(loss_in(health("lio_frontend", "L1_IMU", kLeast, 2)).find("missed 2 messages"), std::string::npos);
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
