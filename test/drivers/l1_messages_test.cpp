// SPDX-License-Identifier: Apache-2.0
#include "drivers/l1_messages.h"

#include <random>

#include <gtest/gtest.h>

#include "drivers/l1_samples.h"

namespace ignis::l1 {
namespace {

Payload random_payload(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  Payload payload(size);
  for (std::byte& byte : payload) byte = static_cast<std::byte>(random());
  return payload;
}

TEST(L1Messages, SurviveARoundTripThroughTheirStructs) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Payload auxiliary = random_payload(209, seed);
    EXPECT_EQ(encode(decode_auxiliary(auxiliary)), auxiliary);
    const Payload distance = random_payload(246, seed);
    EXPECT_EQ(encode(decode_distance(distance)), distance);
    const Payload imu = random_payload(42, seed);
    EXPECT_EQ(encode(decode_imu(imu)), imu);
    const Payload sync = random_payload(5, seed);
    EXPECT_EQ(encode(decode_time_sync(sync)), sync);
  }
}

TEST(L1Messages, HaveTheLengthsOfTheDialect) {
  EXPECT_EQ(encode(Auxiliary{}).size(), message_info(kAuxiliaryId)->length);
  EXPECT_EQ(encode(Distance{}).size(), message_info(kDistanceId)->length);
  EXPECT_EQ(encode(ImuAttitude{}).size(), message_info(kImuId)->length);
  EXPECT_EQ(encode(Version{}).size(), message_info(kVersionId)->length);
  EXPECT_EQ(encode(TimeSync{}).size(), message_info(kTimeSyncId)->length);
  EXPECT_FALSE(message_info(20));
}

TEST(L1Messages, ReadTrimmedBytesAsZeros) {
  Payload imu = encode(samples::imu(7));
  imu.resize(41);
  EXPECT_EQ(decode_imu(imu).packet_id, 7);
  imu.resize(30);  // cuts into the y axis of the force
  EXPECT_EQ(decode_imu(imu).packet_id, 0);
  EXPECT_EQ(decode_imu(imu).accel[2], 0.0F);
  EXPECT_EQ(decode_imu(imu).gyro[2], 0.03F);

  Payload distance = encode(samples::distance(9));
  distance.resize(6 + 3);  // one and a half points
  EXPECT_EQ(decode_distance(distance).ranges_mm[0], 2000);
  EXPECT_EQ(decode_distance(distance).ranges_mm[1], 2000 & 0xFF);
  EXPECT_EQ(decode_distance(distance).ranges_mm[2], 0);
}

TEST(L1Messages, KeepVersionTextsPrintable) {
  const Version version{"1.0.1+230601", "a text that is too long", "1.2", "h\x01"};
  const Version decoded = decode_version(encode(version));
  EXPECT_EQ(decoded.sys_soft, "1.0.1+230601");
  EXPECT_EQ(decoded.com_soft, "a text that i");
  EXPECT_EQ(decoded.sys_hard, "1.2");
  EXPECT_EQ(decoded.com_hard, "h?");
}

TEST(L1Messages, NameTheStatusBitsThatAreSet) {
  EXPECT_EQ(work_status_text(0), "");
  EXPECT_EQ(work_status_text(0x11), "raw mode, IMU error");
  EXPECT_EQ(work_status_text(0x80), "data not available");
}

}  // namespace
}  // namespace ignis::l1
