// SPDX-License-Identifier: Apache-2.0
#include "drivers/packet_pairer.h"

#include <gtest/gtest.h>

#include "drivers/l1_samples.h"

namespace ignis::l1 {
namespace {

using samples::auxiliary;
using samples::distance;

void send(PacketPairer& pairer, const Auxiliary& message, double at_us = 0.0) {
  pairer.on_frame();
  pairer.on_auxiliary(message, at_us);
}

bool pairs(PacketPairer& pairer, const Distance& message, double at_us = 0.0) {
  pairer.on_frame();
  return pairer.on_distance(message, at_us).has_value();
}

TEST(PacketPairer, JoinsRangesWithTheAnglesBeforeThem) {
  PacketPairer pairer;
  send(pairer, auxiliary(7));
  EXPECT_TRUE(pairs(pairer, distance(7)));
  EXPECT_EQ(pairer.counters().paired, 1);
  EXPECT_EQ(pairer.counters().unpaired, 0);
}

TEST(PacketPairer, RefusesAnotherIdAndDropsTheAngles) {
  PacketPairer pairer;
  send(pairer, auxiliary(7));
  EXPECT_FALSE(pairs(pairer, distance(8)));
  EXPECT_FALSE(pairs(pairer, distance(7)));
  EXPECT_EQ(pairer.counters().unpaired, 3);
}

TEST(PacketPairer, RefusesRangesBeforeAnyAngles) {
  PacketPairer pairer;
  EXPECT_FALSE(pairs(pairer, distance(0)));
  EXPECT_EQ(pairer.counters().unpaired, 1);
}

TEST(PacketPairer, UsesAnglesOnce) {
  PacketPairer pairer;
  send(pairer, auxiliary(7));
  EXPECT_TRUE(pairs(pairer, distance(7)));
  EXPECT_FALSE(pairs(pairer, distance(7)));
  EXPECT_EQ(pairer.counters().duplicates, 1);
  EXPECT_EQ(pairer.counters().unpaired, 0);
}

TEST(PacketPairer, TakesTheLatestAngles) {
  PacketPairer pairer;
  send(pairer, auxiliary(7));
  send(pairer, auxiliary(8));
  EXPECT_TRUE(pairs(pairer, distance(8)));
  EXPECT_EQ(pairer.counters().unpaired, 1);
}

TEST(PacketPairer, AllowsInertialFramesBetween) {
  PacketPairer pairer;
  send(pairer, auxiliary(7));
  pairer.on_frame();
  pairer.on_frame();
  EXPECT_TRUE(pairs(pairer, distance(7)));
}

TEST(PacketPairer, RefusesStaleAngles) {
  PacketPairer by_frames;
  send(by_frames, auxiliary(7));
  for (int i = 0; i < 10; ++i) by_frames.on_frame();
  EXPECT_FALSE(pairs(by_frames, distance(7)));

  PacketPairer by_time;
  send(by_time, auxiliary(7), 0.0);
  EXPECT_FALSE(pairs(by_time, distance(7), 16.7e6));
}

}  // namespace
}  // namespace ignis::l1
