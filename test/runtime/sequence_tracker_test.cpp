// SPDX-License-Identifier: Apache-2.0
#include "runtime/sequence_tracker.h"

#include <limits>

#include <gtest/gtest.h>

namespace ignis::runtime {
namespace {

TEST(SequenceTracker, CountsWhatIsMissingBetweenTwoMessages) {
  SequenceTracker tracker;
  EXPECT_EQ(tracker.observe(41), 0) << "a late joiner lost nothing";
  EXPECT_EQ(tracker.observe(42), 0);
  EXPECT_EQ(tracker.observe(46), 3);
}

TEST(SequenceTracker, CountsNothingForPartsRepeatsAndOldKeyframes) {
  SequenceTracker tracker;
  EXPECT_EQ(tracker.observe(9), 0);
  EXPECT_EQ(tracker.observe(9), 0);
  EXPECT_EQ(tracker.observe(0), 0);
  EXPECT_EQ(tracker.observe(3), 0);
  EXPECT_EQ(tracker.observe(10), 0) << "keyframes that were sent again must not look like a loss afterwards";
}

TEST(SequenceTracker, BeginsAnewWhenTheSenderDid) {
  SequenceTracker tracker;
  EXPECT_EQ(tracker.observe(50'000), 0);
  EXPECT_EQ(tracker.observe(0), 0);
  EXPECT_EQ(tracker.observe(2), 1);
}

TEST(Fault_B5, ForgedRunningNumbersAtTheEndsOfTheirRangeAreSurvived) {
  SequenceTracker tracker;
  EXPECT_EQ(tracker.observe(std::numeric_limits<std::int32_t>::min()), 0);
  EXPECT_EQ(tracker.observe(std::numeric_limits<std::int32_t>::max()), 4294967294);
  EXPECT_EQ(tracker.observe(5), 0) << "the true sender is taken for a new one";
  EXPECT_EQ(tracker.observe(7), 1);
}

}  // namespace
}  // namespace ignis::runtime
