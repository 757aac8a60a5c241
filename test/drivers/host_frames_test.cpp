// SPDX-License-Identifier: Apache-2.0
#include "drivers/host_frames.h"

#include <gtest/gtest.h>

#include "drivers/l1_samples.h"

namespace ignis::l1 {
namespace {

using samples::from_hex;

// The bytes that the vendor's library was seen to send, and those that follow from its rules.
TEST(HostFrames, AreTheBytesOfTheVendor) {
  EXPECT_EQ(HostFrames().working_mode(WorkingMode::kStandby), from_hex("fd 01 00 00 00 01 01 0e 00 00 02 ed 78"));
  EXPECT_EQ(HostFrames().working_mode(WorkingMode::kNormal), from_hex("fd 01 00 00 00 01 01 0e 00 00 01 85 52"));
  EXPECT_EQ(HostFrames().version_request(), from_hex("fd 01 00 00 00 01 01 0b 00 00 02 44 86"));
  EXPECT_EQ(HostFrames().time_sync_answer(7), from_hex("fd 05 00 00 00 01 01 12 00 00 07 00 00 00 02 34 5b"));
}

TEST(HostFrames, SetTheLightRingAsTheVendorDoes) {
  EXPECT_EQ(HostFrames().led_ring({}),
            from_hex("fd 0b 00 00 00 01 01 0f 00 00 00 00 00 00 00 00 00 00 00 00 01 39 7a"));
  LedRing on;
  on.table.fill(0xFF);
  const auto bytes = HostFrames().led_ring(on);
  ASSERT_EQ(bytes.size(), 68U);
  EXPECT_EQ(bytes[1], std::byte{0x38});
  EXPECT_EQ(bytes[66], std::byte{0x2b});
  EXPECT_EQ(bytes[67], std::byte{0x92});
  LedRing pattern;
  pattern.mode = 5;
  const auto five = HostFrames().led_ring(pattern);
  EXPECT_EQ(five[21], std::byte{0x59});
  EXPECT_EQ(five[22], std::byte{0x1d});
}

TEST(HostFrames, NumberEachFrame) {
  HostFrames frames;
  (void)frames.version_request();
  EXPECT_EQ(frames.working_mode(WorkingMode::kNormal), from_hex("fd 01 00 00 01 01 01 0e 00 00 01 3a d3"));
}

TEST(LedRing, ComesBackFromItsBytes) {
  LedRing ring;
  ring.rotation_period = 1;
  ring.zero_offset_ms = 2;
  ring.packet_id = 3;
  ring.mode = 4;
  ring.table[44] = 5;
  const LedRing back = decode_led_ring(encode(ring));
  EXPECT_EQ(encode(ring).size(), 56U);
  EXPECT_EQ(back.rotation_period, 1U);
  EXPECT_EQ(back.zero_offset_ms, 2U);
  EXPECT_EQ(back.packet_id, 3U);
  EXPECT_EQ(back.mode, 4U);
  EXPECT_EQ(back.table[44], 5U);
}

}  // namespace
}  // namespace ignis::l1
