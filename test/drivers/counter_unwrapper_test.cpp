// SPDX-License-Identifier: Apache-2.0
#include "drivers/counter_unwrapper.h"

#include <gtest/gtest.h>

namespace ignis::l1 {
namespace {

constexpr double kPeriod = 4000.0;
constexpr double kSlack = 1e6;

TEST(CounterUnwrapper, CountsStepsAndRepeats) {
  CounterUnwrapper counter(kPeriod);
  EXPECT_EQ(counter.advance(240, 0.0, kSlack), 0);
  EXPECT_EQ(counter.count(), 240);
  EXPECT_EQ(counter.advance(241, kPeriod, kSlack), 1);
  EXPECT_EQ(counter.advance(241, kPeriod, kSlack), 0);
  EXPECT_EQ(counter.advance(244, 3 * kPeriod, kSlack), 3);
  EXPECT_EQ(counter.count(), 244);
}

TEST(CounterUnwrapper, FollowsAnyModulus) {
  for (const int modulus : {1024, 4000, 65536}) {
    CounterUnwrapper counter(kPeriod);
    for (int i = 0; i < 3 * modulus; ++i) {
      ASSERT_EQ(counter.advance(static_cast<std::uint16_t>(i % modulus), kPeriod, kSlack), i == 0 ? 0 : 1) << i;
    }
  }
}

TEST(CounterUnwrapper, PassesOverAFrameThatOthersHaveOvertaken) {
  CounterUnwrapper counter(kPeriod);
  (void)counter.advance(10, 0.0, kSlack);
  (void)counter.advance(12, 2 * kPeriod, kSlack);
  EXPECT_EQ(counter.advance(11, 0.1 * kPeriod, kSlack), 0);
  EXPECT_EQ(counter.count(), 12);
  EXPECT_EQ(counter.advance(13, kPeriod, kSlack), 1);
  EXPECT_EQ(counter.advance(20, 7 * kPeriod, kSlack), 7);
}

TEST(CounterUnwrapper, UsesTheModulusItHasSeenForALossAcrossAWrap) {
  CounterUnwrapper counter(kPeriod);
  for (int i = 0; i < 1025; ++i) (void)counter.advance(static_cast<std::uint16_t>(i % 1024), kPeriod, kSlack);
  (void)counter.advance(1020, 1020 * kPeriod, kSlack);
  // 5 steps, although the host was late and thinks that 200 periods have passed.
  EXPECT_EQ(counter.advance(1, 200 * kPeriod, kSlack), 5);
}

TEST(CounterUnwrapper, TakesElapsedTimeWhenTheSensorRestarts) {
  CounterUnwrapper counter(kPeriod);
  (void)counter.advance(30'000, 0.0, kSlack);
  EXPECT_EQ(counter.advance(3, 500 * kPeriod, kSlack), 500);
  EXPECT_EQ(counter.advance(4, kPeriod, kSlack), 1);
}

TEST(CounterUnwrapper, DoesNotBelieveAJumpLongerThanTheTimeAllows) {
  CounterUnwrapper counter(kPeriod);
  (void)counter.advance(3, 0.0, kSlack);
  EXPECT_EQ(counter.advance(30'000, 10 * kPeriod, kSlack), 10);
}

}  // namespace
}  // namespace ignis::l1
