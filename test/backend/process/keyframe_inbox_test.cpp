// SPDX-License-Identifier: Apache-2.0
#include "graph_backend/keyframe_inbox.h"

#include <limits>

#include <gtest/gtest.h>

namespace ignis {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Ids = std::vector<std::int32_t>;

constexpr KeyframeInbox::Time kStart = KeyframeInbox::Time{} + std::chrono::hours(1);

Keyframe numbered(std::int32_t id) {
  Keyframe keyframe;
  keyframe.id = id;
  return keyframe;
}

TEST(KeyframeInbox, HandsOutInOrderAndHoldsWhatCameTooEarly) {
  KeyframeInbox inbox;
  EXPECT_TRUE(inbox.put(numbered(2), 0, kStart));
  EXPECT_FALSE(inbox.take(1).has_value());
  EXPECT_FALSE(inbox.empty());
  EXPECT_TRUE(inbox.put(numbered(1), 0, kStart));
  EXPECT_EQ(inbox.take(1)->id, 1);
  EXPECT_EQ(inbox.take(2)->id, 2);
  EXPECT_TRUE(inbox.empty());
}

TEST(KeyframeInbox, HandsOutRepeatsToo) {
  KeyframeInbox inbox;
  EXPECT_TRUE(inbox.put(numbered(3), 0, kStart));
  EXPECT_EQ(inbox.take(7)->id, 3);
}

TEST(KeyframeInbox, AsksForWhatIsMissingBeforeTheNewestOnly) {
  KeyframeInbox inbox;
  EXPECT_TRUE(inbox.put(numbered(5), 0, kStart));
  EXPECT_TRUE(inbox.put(numbered(8), 0, kStart));
  EXPECT_EQ(inbox.ids_to_request(3, kStart), (Ids{3, 4, 6, 7}));
}

TEST(KeyframeInbox, AsksForAtMostSixteenAtOnce) {
  KeyframeInbox inbox;
  EXPECT_TRUE(inbox.put(numbered(100), 0, kStart));
  const Ids ids = inbox.ids_to_request(0, kStart);
  ASSERT_EQ(ids.size(), 16U);
  EXPECT_EQ(ids.back(), 15);
}

TEST(KeyframeInbox, AsksAgainAfterThreeTenthsOfASecond) {
  KeyframeInbox inbox;
  EXPECT_TRUE(inbox.put(numbered(1), 0, kStart));
  EXPECT_EQ(inbox.ids_to_request(0, kStart), Ids{0});
  EXPECT_TRUE(inbox.ids_to_request(0, kStart + milliseconds(299)).empty());
  EXPECT_EQ(inbox.ids_to_request(0, kStart + milliseconds(300)), Ids{0});
}

TEST(KeyframeInbox, AsksForTheNextOnesAfterAQuietSecond) {
  KeyframeInbox inbox;
  EXPECT_TRUE(inbox.put(numbered(0), 0, kStart));
  EXPECT_EQ(inbox.take(0)->id, 0);
  EXPECT_TRUE(inbox.ids_to_request(1, kStart + milliseconds(999)).empty());
  const Ids ids = inbox.ids_to_request(1, kStart + seconds(1));
  ASSERT_FALSE(ids.empty());
  EXPECT_EQ(ids.front(), 1);
  EXPECT_TRUE(inbox.ids_to_request(1, kStart + milliseconds(1900)).empty());
}

TEST(KeyframeInbox, GivesUpAfterFortyRequestsForTheSameGap) {
  KeyframeInbox inbox;
  EXPECT_TRUE(inbox.put(numbered(4), 0, kStart));
  KeyframeInbox::Time now = kStart;
  for (int i = 0; i < 40; ++i, now += milliseconds(300)) {
    ASSERT_FALSE(inbox.ids_to_request(2, now).empty());
    EXPECT_FALSE(inbox.hopeless_before(2).has_value()) << i;
  }
  EXPECT_FALSE(inbox.ids_to_request(2, now).empty());
  EXPECT_EQ(inbox.hopeless_before(2), 4);
  EXPECT_FALSE(inbox.hopeless_before(3).has_value());
}

TEST(KeyframeInbox, AnotherGapIsCountedAnew) {
  KeyframeInbox inbox;
  EXPECT_TRUE(inbox.put(numbered(9), 0, kStart));
  KeyframeInbox::Time now = kStart;
  for (int i = 0; i < 41; ++i, now += milliseconds(300)) (void)inbox.ids_to_request(2, now);
  (void)inbox.ids_to_request(5, now);
  EXPECT_FALSE(inbox.hopeless_before(5).has_value());
}

TEST(KeyframeInbox, ForgetsWhatItHoldsWhenCleared) {
  KeyframeInbox inbox;
  EXPECT_TRUE(inbox.put(numbered(1), 0, kStart));
  inbox.clear();
  EXPECT_TRUE(inbox.empty());
  EXPECT_FALSE(inbox.take(1).has_value());
}

TEST(KeyframeInbox, ForgetsHowOftenItAskedWhenCleared) {
  KeyframeInbox inbox;
  EXPECT_TRUE(inbox.put(numbered(4), 0, kStart));
  KeyframeInbox::Time now = kStart;
  for (int i = 0; i < 41; ++i, now += milliseconds(300)) (void)inbox.ids_to_request(0, now);
  ASSERT_TRUE(inbox.hopeless_before(0).has_value());
  inbox.clear();
  EXPECT_TRUE(inbox.put(numbered(1), 0, now));
  EXPECT_FALSE(inbox.hopeless_before(0).has_value()) << "the new drive's first keyframe was overtaken, no more";
  EXPECT_EQ(inbox.ids_to_request(0, now), Ids{0});
  EXPECT_FALSE(inbox.hopeless_before(0).has_value());
}

/// One that says which instant it follows.
Keyframe following(std::int32_t id, Utime previous_utime, Utime utime) {
  Keyframe keyframe = numbered(id);
  keyframe.previous_utime = previous_utime;
  keyframe.state.utime = utime;
  return keyframe;
}

TEST(KeyframeInbox, HoldsTheFiftyThatComeNextAndCountsTheOthers) {
  KeyframeInbox inbox;
  for (std::int32_t id = 60; id > 0; --id) EXPECT_TRUE(inbox.put(numbered(id), 0, kStart));
  EXPECT_EQ(inbox.dropped(), 10);
  std::int32_t held = 0;
  while (const auto keyframe = inbox.take(held + 1)) EXPECT_EQ(keyframe->id, ++held);
  EXPECT_EQ(held, 50);
}

TEST(KeyframeInbox, PutsOneAsideThatIsFarAheadOfAllOthers) {
  KeyframeInbox inbox;
  EXPECT_TRUE(inbox.put(numbered(1003), 3, kStart)) << "a thousand are missed in an hour of standing";
  EXPECT_TRUE(inbox.put(numbered(2003), 3, kStart)) << "not far from the newest that waits";
  inbox.clear();
  EXPECT_FALSE(inbox.put(numbered(1004), 3, kStart));
  EXPECT_TRUE(inbox.empty());
  EXPECT_TRUE(inbox.put(numbered(4), 3, kStart));
  EXPECT_EQ(inbox.ids_to_request(3, kStart), Ids{3});
}

TEST(KeyframeInbox, BelievesThoseFarAheadOnceOneCarriesOnFromTheOther) {
  KeyframeInbox inbox;
  EXPECT_FALSE(inbox.put(following(7000, 1, 2), 3, kStart));
  EXPECT_FALSE(inbox.put(following(7001, 1, 3), 3, kStart)) << "does not begin where the first one ends";
  EXPECT_FALSE(inbox.put(following(7003, 3, 4), 3, kStart)) << "nor the next id";
  EXPECT_TRUE(inbox.put(following(7004, 4, 5), 3, kStart));
  EXPECT_TRUE(inbox.put(following(7005, 5, 6), 3, kStart));
  for (const std::int32_t id : {7003, 7004, 7005}) EXPECT_EQ(inbox.take(id)->id, id);
}

TEST(KeyframeInbox, ForgetsWhatItPutAsideWhenCleared) {
  KeyframeInbox inbox;
  EXPECT_FALSE(inbox.put(following(7000, 1, 2), 3, kStart));
  inbox.clear();
  EXPECT_FALSE(inbox.put(following(7001, 2, 3), 3, kStart));
}

TEST(KeyframeInbox, AsksForNoIdBeyondTheLastOne) {
  KeyframeInbox inbox;
  constexpr std::int32_t kLast = std::numeric_limits<std::int32_t>::max();
  EXPECT_EQ(inbox.ids_to_request(kLast - 1, kStart), Ids{kLast - 1});
  EXPECT_TRUE(inbox.ids_to_request(kLast, kStart + seconds(2)).empty());
}

}  // namespace
}  // namespace ignis
