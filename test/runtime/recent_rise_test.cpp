// SPDX-License-Identifier: Apache-2.0
#include "runtime/recent_rise.h"

#include <gtest/gtest.h>

namespace ignis::runtime {
namespace {

using std::chrono::seconds;

const RecentRise::TimePoint kStart{};

TEST(RecentRise, IsOverAfterItsTimeAndBeginsAnewWithEachRise) {
  RecentRise troubles(seconds(60));
  EXPECT_FALSE(troubles.look(0, kStart));
  EXPECT_TRUE(troubles.look(1, kStart + seconds(1)));
  EXPECT_TRUE(troubles.look(2, kStart + seconds(50)));
  EXPECT_TRUE(troubles.look(2, kStart + seconds(109)));
  EXPECT_FALSE(troubles.look(2, kStart + seconds(110)));
  EXPECT_TRUE(troubles.look(3, kStart + seconds(200)));
}

TEST(RecentRise, ACounterThatBeganAnewHasNotRisen) {
  RecentRise troubles(seconds(60));
  EXPECT_TRUE(troubles.look(5, kStart));
  EXPECT_FALSE(troubles.look(0, kStart + seconds(1)));
  EXPECT_TRUE(troubles.look(1, kStart + seconds(2)));
}

}  // namespace
}  // namespace ignis::runtime
