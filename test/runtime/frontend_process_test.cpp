// SPDX-License-Identifier: Apache-2.0
//
// What the front end's process adds to the odometry: the order of its states, and the keyframes and clouds it sends
// again.
#include <gtest/gtest.h>

#include "lio_frontend/sent_clouds.h"
#include "lio_frontend/sent_keyframes.h"
#include "lio_frontend/state_order.h"

namespace ignis {
namespace {

const Matrix15d kEarlier = Matrix15d::Identity();
const Matrix15d kLater = 2.0 * Matrix15d::Identity();

TEST(StateOrder, AScanThatIsNewestIsToldAtOnceAndOwesNothing) {
  StateOrder order;
  EXPECT_TRUE(order.take_scan(0, 100, kEarlier));
  EXPECT_FALSE(order.take_sample(0, 104).has_value());
}

TEST(StateOrder, ALateScansCovarianceGoesWithTheNextSampleAndOnlyWithThat) {
  StateOrder order;
  (void)order.take_sample(0, 104);
  EXPECT_FALSE(order.take_scan(0, 100, kEarlier));
  EXPECT_EQ(order.take_sample(0, 108), kEarlier);
  EXPECT_FALSE(order.take_sample(0, 112).has_value());
}

TEST(StateOrder, ACovarianceOfTheOldSessionIsNotOwedToTheNewOne) {
  StateOrder order;
  (void)order.take_sample(3, 104);
  EXPECT_FALSE(order.take_scan(3, 100, kEarlier));
  EXPECT_FALSE(order.take_sample(4, 108).has_value());
  EXPECT_FALSE(order.take_sample(4, 112).has_value()) << "nor later";
}

TEST(StateOrder, AnOlderCovarianceIsNotOwedAfterANewerOneWasTold) {
  StateOrder order;
  (void)order.take_sample(0, 104);
  EXPECT_FALSE(order.take_scan(0, 100, kEarlier));
  EXPECT_TRUE(order.take_scan(0, 150, kLater));
  EXPECT_FALSE(order.take_sample(0, 154).has_value());
}

TEST(StateOrder, ANewSessionMayBeginWithAnEarlierStamp) {
  StateOrder order;
  (void)order.take_sample(0, 1000);
  EXPECT_TRUE(order.take_scan(1, 500, kLater));
}

Keyframe keyframe(std::int32_t session, std::int32_t id, std::size_t points) {
  Keyframe made;
  made.session = session;
  made.id = id;
  made.imu.resize(900);
  made.cloud.resize(points, {.position = {1.0F, 2.0F, 3.0F}, .intensity = 7.0F});
  return made;
}

TEST(SentKeyframes, KeepsTheNewestAndGivesThemBackAsTheyWereSent) {
  SentKeyframes sent(3);
  for (std::int32_t id = 0; id < 10; ++id) {
    EXPECT_EQ(sent.add(keyframe(2, id, 5000)).size(), 2U) << "two parts of one datagram each";
  }
  EXPECT_EQ(sent.size(), 3U);
  EXPECT_EQ(sent.find(2, 6), nullptr) << "beyond the limit";
  EXPECT_EQ(sent.find(1, 9), nullptr) << "of another session";
  ASSERT_NE(sent.find(2, 9), nullptr);
  EXPECT_EQ(sent.find(2, 9)->front().id, 9);
}

/// Killed between writing a keyframe and the state that holds its number: a successor reads it back and makes another.
TEST(SentKeyframes, GivesBackTheOneThatWasToldAndNotOneThatAKilledProcessLeft) {
  SentKeyframes sent(3);
  Keyframe left = keyframe(2, 7, 5000);
  left.state.utime = 1'000'000;
  Keyframe told = left;
  told.state.utime = 1'050'000;
  sent.add(left);
  sent.add(told);
  ASSERT_NE(sent.find(2, 7), nullptr);
  EXPECT_EQ(sent.find(2, 7)->front().utime, 1'050'000);
  EXPECT_EQ(sent.size(), 1U);
}

TEST(SentKeyframes, TakesNoMoreRoomThanTheMessagesNeed) {
  SentKeyframes sent(1);
  for (const keyframe_t& part : sent.add(keyframe(0, 0, 5000))) {
    EXPECT_EQ(part.x.capacity(), part.x.size());
    EXPECT_EQ(part.intensity.capacity(), part.intensity.size());
    EXPECT_EQ(part.gyro_x.capacity(), part.gyro_x.size());
  }
}

messages::PosedCloud cloud(std::int32_t number, std::size_t points) {
  messages::PosedCloud made;
  made.utime = 50'000 * number;
  made.sequence = number;
  made.session = 4;
  made.points.resize(points, {.position = {1.0F, 2.0F, 3.0F}, .intensity = 7.0F});
  return made;
}

TEST(SentClouds, GivesBackWhatWasSentWithTheKeyframeMadeOfIt) {
  SentClouds sent(1'000'000, 1'000'000);
  EXPECT_EQ(sent.add(cloud(7, 10)).size(), 1U);
  sent.note_keyframe(3);
  EXPECT_EQ(sent.add(cloud(8, 3000)).size(), 2U);
  ASSERT_NE(sent.find(4, 7), nullptr);
  EXPECT_EQ(sent.find(4, 7)->parts.front().num_points, 10);
  EXPECT_EQ(sent.find(4, 7)->keyframe, 3);
  EXPECT_EQ(sent.find(4, 8)->parts.size(), 2U);
  EXPECT_EQ(sent.find(4, 8)->keyframe, std::nullopt);
  EXPECT_EQ(sent.find(5, 7), nullptr) << "another session";
  EXPECT_EQ(sent.find(4, 9), nullptr);
}

TEST(SentClouds, KeepsAStretchOfTime) {
  SentClouds sent(1'000'000, 1'000'000);
  for (std::int32_t number = 0; number < 100; ++number) sent.add(cloud(number, 10));
  EXPECT_EQ(sent.size(), 21U);
  EXPECT_EQ(sent.find(4, 78), nullptr);
  EXPECT_NE(sent.find(4, 79), nullptr);
}

TEST(SentClouds, KeepsABoundedNumberOfBytesAndTheNewestInAnyCase) {
  SentClouds sent(1'000'000'000, 100'000);
  for (std::int32_t number = 0; number < 100; ++number) {
    sent.add(cloud(number, 1000));
    EXPECT_LE(sent.bytes(), 100'000U);
  }
  EXPECT_EQ(sent.size(), 6U);
  sent.add(cloud(100, 20'000));
  EXPECT_EQ(sent.size(), 1U);
}

}  // namespace
}  // namespace ignis
