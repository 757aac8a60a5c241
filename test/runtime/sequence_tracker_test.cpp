// SPDX-License-Identifier: Apache-2.0
#include "runtime/sequence_tracker.h"

#include <limits>

#include <gtest/gtest.h>

namespace ignis::runtime {
namespace {

TEST(SequenceTracker, CountsWhatIsMissingBetweenTwoMessages) {
  SequenceTracker tracker;
  EXPECT_EQ(tracker.observe(41, 1041), 0) << "a late joiner lost nothing";
  EXPECT_EQ(tracker.observe(42, 1042), 0);
  EXPECT_EQ(tracker.observe(46, 1046), 3);
}

TEST(SequenceTracker, CountsNothingForPartsRepeatsAndOldKeyframes) {
  SequenceTracker tracker;
  EXPECT_EQ(tracker.observe(9, 1009), 0);
  EXPECT_EQ(tracker.observe(9, 1009), 0);
  EXPECT_EQ(tracker.observe(0, 1000), 0);
  EXPECT_EQ(tracker.observe(3, 1003), 0);
  EXPECT_EQ(tracker.fresh(), 1);
  EXPECT_EQ(tracker.observe(10, 1010), 0) << "keyframes that were sent again must not look like a loss afterwards";
}

TEST(SequenceTracker, BeginsAnewWhenTheSenderDid) {
  SequenceTracker tracker;
  EXPECT_EQ(tracker.observe(50'000, 9'000'000), 0);
  EXPECT_EQ(tracker.observe(0, 8'000), 0) << "whatever its stamps: its clock may have begun anew with it";
  EXPECT_EQ(tracker.observe(2, 8'002), 1);
}

TEST(Fault_B1, WhatIsLostSoonAfterASenderBeganAnewEarlyIsCounted) {
  SequenceTracker tracker;
  for (std::int32_t i = 0; i < 900; ++i) EXPECT_EQ(tracker.observe(i, 50'000LL * i), 0);
  EXPECT_EQ(tracker.observe(0, 50'000LL * 910), 0) << "it began anew: what was lost before nobody knows";
  EXPECT_EQ(tracker.observe(5, 50'000LL * 915), 4);
  EXPECT_EQ(tracker.observe(3, 50'000LL * 913), 0) << "late";
  EXPECT_EQ(tracker.observe(6, 50'000LL * 916), 0);
  EXPECT_EQ(tracker.fresh(), 903);
}

TEST(Fault_B5, ForgedRunningNumbersAtTheEndsOfTheirRangeAreSurvived) {
  SequenceTracker tracker;
  EXPECT_EQ(tracker.observe(std::numeric_limits<std::int32_t>::min(), 0), 0);
  EXPECT_EQ(tracker.observe(std::numeric_limits<std::int32_t>::max(), 0), 4294967294);
  EXPECT_EQ(tracker.observe(5, 1005), 0) << "the true sender is taken for a new one";
  EXPECT_EQ(tracker.observe(7, 1007), 1);
}

}  // namespace
}  // namespace ignis::runtime
