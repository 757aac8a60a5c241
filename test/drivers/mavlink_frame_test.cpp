// SPDX-License-Identifier: Apache-2.0
#include "drivers/mavlink_frame.h"

#include <cstring>

#include <gtest/gtest.h>

#include "drivers/l1_samples.h"

namespace ignis::l1 {
namespace {

using samples::Bytes;
using samples::from_hex;

std::span<const std::byte> bytes_of(const char* text) { return std::as_bytes(std::span(text, std::strlen(text))); }

const char* const kImuFloats =
    "00 00 80 3f 00 00 00 00 00 00 00 00 00 00 00 00 0a d7 23 3c 0a d7 a3 bc 8f c2 f5 3c cd cc cc 3d cd cc 4c be c3 f5 "
    "1c 41";

Auxiliary auxiliary_of_the_protocol_sheet() {
  Auxiliary message = samples::auxiliary(300);
  message.sync_delay_us = 8714;
  message.time_s = 7;
  message.time_us = 156010;
  message.sys_rotation_period_us = 5556;
  message.com_rotation_period_us = 99010;
  message.apd_temperature = 41.5F;
  message.imu_temperature = 45.25F;
  message.up_optical_q = 99.5F;
  message.down_optical_q = 99.25F;
  message.apd_voltage = 135.0F;
  return message;
}

TEST(Crc16, MatchesTheCheckValueOfItsDefinition) { EXPECT_EQ(crc16(bytes_of("123456789")), 0x6F91); }

TEST(Crc16, ContinuesFromAnEarlierPart) { EXPECT_EQ(crc16(bytes_of("6789"), crc16(bytes_of("12345"))), 0x6F91); }

TEST(EncodeFrame, GivesTheBytesThatTheVendorsLibraryAccepts) {
  EXPECT_EQ(samples::frame(kImuId, samples::imu(300), 5),
            from_hex(std::string("fd 2a 00 00 05 01 01 13 00 00 ") + kImuFloats + " 2c 01 fc 07"));
  EXPECT_EQ(samples::frame(kTimeSyncId, TimeSync{7, TimeSync::kRequest}),
            from_hex("fd 05 00 00 00 01 01 12 00 00 07 00 00 00 01 5c 71"));
}

TEST(EncodeFrame, GivesTheBytesThatTheVendorsLibrarySends) {
  EXPECT_EQ(samples::frame(kTimeSyncId, TimeSync{7, TimeSync::kResponse}, 1),
            from_hex("fd 05 00 00 01 01 01 12 00 00 07 00 00 00 02 61 de"));
  EXPECT_EQ(samples::frame(kRequestDataId, DataRequest::kVersion), from_hex("fd 01 00 00 00 01 01 0b 00 00 02 44 86"));
  EXPECT_EQ(samples::frame(kWorkingModeId, WorkingMode::kStandby), from_hex("fd 01 00 00 00 01 01 0e 00 00 02 ed 78"));
  EXPECT_EQ(samples::frame(kWorkingModeId, WorkingMode::kNormal, 1),
            from_hex("fd 01 00 00 01 01 01 0e 00 00 01 3a d3"));
}

TEST(EncodeFrame, GivesTheChecksumsOfTheProtocolSheetsScan) {
  const Bytes auxiliary = samples::frame(kAuxiliaryId, auxiliary_of_the_protocol_sheet(), 9);
  ASSERT_EQ(auxiliary.size(), 221U);
  EXPECT_EQ(Bytes(auxiliary.begin(), auxiliary.begin() + 10), from_hex("fd d1 00 00 09 01 01 11 00 00"));
  EXPECT_EQ(Bytes(auxiliary.end() - 2, auxiliary.end()), from_hex("87 df"));

  const Bytes distance = samples::frame(kDistanceId, samples::distance(300), 10);
  ASSERT_EQ(distance.size(), 258U);
  EXPECT_EQ(Bytes(distance.begin(), distance.begin() + 10), from_hex("fd f6 00 00 0a 01 01 10 00 00"));
  EXPECT_EQ(Bytes(distance.end() - 2, distance.end()), from_hex("e2 2f"));
}

TEST(EncodeFrame, TrimsTrailingZerosOnlyWhenAsked) {
  const Payload payload = encode(samples::imu(7));
  EXPECT_EQ(encode_frame(kImuId, payload, 5, Trim::kYes),
            from_hex(std::string("fd 29 00 00 05 01 01 13 00 00 ") + kImuFloats + " 07 b7 96"));
  EXPECT_EQ(encode_frame(kImuId, payload, 5, Trim::kNo),
            from_hex(std::string("fd 2a 00 00 05 01 01 13 00 00 ") + kImuFloats + " 07 00 b9 34"));
}

TEST(EncodeFrame, KeepsOneByteOfAnAllZeroPayload) {
  const Bytes frame = encode_frame(kTimeSyncId, Payload(5), 0);
  EXPECT_EQ(frame.size(), kHeaderSize + 1 + kChecksumSize);
}

TEST(EncodeFrame, CarriesTheSendersAddress) {
  const Bytes frame = encode_frame(kTimeSyncId, Payload(5), 0, Trim::kYes, {.system = 7, .component = 200});
  EXPECT_EQ(frame[5], std::byte{7});
  EXPECT_EQ(frame[6], std::byte{200});
}

}  // namespace
}  // namespace ignis::l1
