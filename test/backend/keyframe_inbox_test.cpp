// SPDX-License-Identifier: Apache-2.0
#include "graph_backend/keyframe_inbox.h"

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
  inbox.put(numbered(2), kStart);
  EXPECT_FALSE(inbox.take(1).has_value());
  EXPECT_FALSE(inbox.empty());
  inbox.put(numbered(1), kStart);
  EXPECT_EQ(inbox.take(1)->id, 1);
  EXPECT_EQ(inbox.take(2)->id, 2);
  EXPECT_TRUE(inbox.empty());
}

TEST(KeyframeInbox, HandsOutRepeatsToo) {
  KeyframeInbox inbox;
  inbox.put(numbered(3), kStart);
  EXPECT_EQ(inbox.take(7)->id, 3);
}

TEST(KeyframeInbox, AsksForWhatIsMissingBeforeTheNewestOnly) {
  KeyframeInbox inbox;
  inbox.put(numbered(5), kStart);
  inbox.put(numbered(8), kStart);
  EXPECT_EQ(inbox.ids_to_request(3, kStart), (Ids{3, 4, 6, 7}));
}

TEST(KeyframeInbox, AsksForAtMostSixteenAtOnce) {
  KeyframeInbox inbox;
  inbox.put(numbered(100), kStart);
  const Ids ids = inbox.ids_to_request(0, kStart);
  ASSERT_EQ(ids.size(), 16U);
  EXPECT_EQ(ids.back(), 15);
}

TEST(KeyframeInbox, AsksAgainAfterThreeTenthsOfASecond) {
  KeyframeInbox inbox;
  inbox.put(numbered(1), kStart);
  EXPECT_EQ(inbox.ids_to_request(0, kStart), Ids{0});
  EXPECT_TRUE(inbox.ids_to_request(0, kStart + milliseconds(299)).empty());
  EXPECT_EQ(inbox.ids_to_request(0, kStart + milliseconds(300)), Ids{0});
}

TEST(KeyframeInbox, AsksForTheNextOnesAfterAQuietSecond) {
  KeyframeInbox inbox;
  inbox.put(numbered(0), kStart);
  EXPECT_EQ(inbox.take(0)->id, 0);
  EXPECT_TRUE(inbox.ids_to_request(1, kStart + milliseconds(999)).empty());
  const Ids ids = inbox.ids_to_request(1, kStart + seconds(1));
  ASSERT_FALSE(ids.empty());
  EXPECT_EQ(ids.front(), 1);
  EXPECT_TRUE(inbox.ids_to_request(1, kStart + milliseconds(1900)).empty());
}

TEST(KeyframeInbox, GivesUpAfterFortyRequestsForTheSameGap) {
  KeyframeInbox inbox;
  inbox.put(numbered(4), kStart);
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
  inbox.put(numbered(9), kStart);
  KeyframeInbox::Time now = kStart;
  for (int i = 0; i < 41; ++i, now += milliseconds(300)) (void)inbox.ids_to_request(2, now);
  (void)inbox.ids_to_request(5, now);
  EXPECT_FALSE(inbox.hopeless_before(5).has_value());
}

TEST(KeyframeInbox, ForgetsWhatItHoldsWhenCleared) {
  KeyframeInbox inbox;
  inbox.put(numbered(1), kStart);
  inbox.clear();
  EXPECT_TRUE(inbox.empty());
  EXPECT_FALSE(inbox.take(1).has_value());
}

TEST(KeyframeInbox, ForgetsHowOftenItAskedWhenCleared) {
  KeyframeInbox inbox;
  inbox.put(numbered(4), kStart);
  KeyframeInbox::Time now = kStart;
  for (int i = 0; i < 41; ++i, now += milliseconds(300)) (void)inbox.ids_to_request(0, now);
  ASSERT_TRUE(inbox.hopeless_before(0).has_value());
  inbox.clear();
  inbox.put(numbered(1), now);
  EXPECT_FALSE(inbox.hopeless_before(0).has_value()) << "the new drive's first keyframe was overtaken, no more";
  EXPECT_EQ(inbox.ids_to_request(0, now), Ids{0});
  EXPECT_FALSE(inbox.hopeless_before(0).has_value());
}

}  // namespace
}  // namespace ignis
