// SPDX-License-Identifier: Apache-2.0
#include "messages/sensor_messages.h"

#include <limits>
#include <memory>
#include <ranges>

#include <gtest/gtest.h>

#include "decoded_scan_assembler.h"
#include "messages/length_check.h"

namespace ignis::messages {
namespace {

Scan scan_of(std::int32_t points) {
  Scan scan{.utime = 1'000, .sequence = 17, .duration_us = 50'000, .missing_packets = 2, .points = {}};
  for (std::int32_t i = 0; i < points; ++i) {
    const float value = static_cast<float>(i);
    scan.points.push_back({.position = {value, -value, 0.5F * value}, .intensity = 3.0F, .dt_us = i});
  }
  return scan;
}

TEST(SensorMessages, ImuSurvivesTheRoundTrip) {
  const ImuSample sample{
      .utime = 5, .sequence = 9, .gyro = {0.1, 0.2, 0.3}, .accel = {1.0, 9.81, -2.0}, .saturated = true};
  const ImuSample back = from_message(to_message(sample));
  EXPECT_EQ(back.utime, sample.utime);
  EXPECT_EQ(back.sequence, sample.sequence);
  EXPECT_EQ(back.gyro, sample.gyro);
  EXPECT_EQ(back.accel, sample.accel);
  EXPECT_TRUE(back.saturated);
}

std::vector<std::byte> encoded(const scan_t& message) {
  std::vector<std::byte> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

TEST(SensorMessages, TheHeadOfAScanIsReadWithoutItsPoints) {
  for (const scan_t& part : to_messages(scan_of(7'000))) {
    const std::optional<ScanHead> head = read_scan_head(encoded(part));
    ASSERT_TRUE(head);
    EXPECT_EQ(head->utime, part.utime);
    EXPECT_EQ(head->sequence, part.sequence);
    EXPECT_EQ(head->part, part.part);
    EXPECT_EQ(head->part_count, 3);
  }
}

TEST(SensorMessages, AHeadIsRefusedWhereTheMessageIs) {
  scan_t message = to_messages(scan_of(5)).front();
  std::vector<std::byte> data = encoded(message);
  EXPECT_FALSE(read_scan_head(std::span(data).first(data.size() - 1))) << "too short for its points";
  EXPECT_FALSE(read_scan_head({}));
  data[0] ^= std::byte{1};
  EXPECT_FALSE(read_scan_head(data)) << "another type";
  message.utime = std::numeric_limits<Utime>::max();
  EXPECT_FALSE(read_scan_head(encoded(message))) << "no such time";
}

class ScanParts : public testing::TestWithParam<std::int32_t> {};

TEST_P(ScanParts, FitOneDatagramEachAndComeTogetherAgain) {
  const Scan scan = scan_of(GetParam());
  DecodedScanAssembler assembler;
  std::optional<Scan> back;
  for (const scan_t& part : to_messages(scan)) {
    EXPECT_LE(part.getEncodedSize(), 64'000);
    ASSERT_FALSE(back);
    back = assembler.add(part);
  }
  ASSERT_TRUE(back);
  EXPECT_EQ(back->utime, scan.utime);
  EXPECT_EQ(back->sequence, scan.sequence);
  EXPECT_EQ(back->duration_us, scan.duration_us);
  EXPECT_EQ(back->missing_packets, scan.missing_packets);
  ASSERT_EQ(back->points.size(), scan.points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    ASSERT_EQ(back->points[i].position, scan.points[i].position);
    ASSERT_EQ(back->points[i].dt_us, scan.points[i].dt_us);
  }
}

TEST_P(ScanParts, ReadFromTheirBytesAreTheDecodedOnesInAnyOrder) {
  std::vector<std::vector<std::byte>> bytes;
  DecodedScanAssembler decoding;
  std::optional<Scan> decoded;
  for (const scan_t& part : to_messages(scan_of(GetParam()))) {
    bytes.push_back(encoded(part));
    decoded = decoding.add(part);
  }
  EncodedScanAssembler assembler;
  std::optional<EncodedScan> whole;
  for (const std::vector<std::byte>& each : bytes | std::views::reverse) {
    ASSERT_FALSE(whole);
    ASSERT_FALSE(assembler.add(std::span(each).first(each.size() - 1))) << "a damaged part is none";
    whole = assembler.add(each);
  }
  ASSERT_TRUE(whole && decoded);
  const Scan frame = whole->read_frame();
  EXPECT_EQ(frame.end_utime(), decoded->end_utime());
  EXPECT_EQ(frame.sequence, decoded->sequence);
  EXPECT_TRUE(frame.points.empty());
  const Scan scan = whole->read();
  EXPECT_EQ(scan.utime, decoded->utime);
  EXPECT_EQ(scan.sequence, decoded->sequence);
  EXPECT_EQ(scan.duration_us, decoded->duration_us);
  EXPECT_EQ(scan.missing_packets, decoded->missing_packets);
  ASSERT_EQ(scan.points.size(), decoded->points.size());
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    ASSERT_EQ(scan.points[i].position, decoded->points[i].position);
    ASSERT_EQ(scan.points[i].intensity, decoded->points[i].intensity);
    ASSERT_EQ(scan.points[i].dt_us, decoded->points[i].dt_us);
  }
}

TEST(SensorMessages, BytesOfAScanAreKeptByTheirOwnersAndOnlyAsLongAsTheyAreNeeded) {
  const std::vector<scan_t> parts = to_messages(scan_of(7'000));
  EncodedScanAssembler assembler;
  std::vector<std::weak_ptr<const std::vector<std::byte>>> kept;
  std::optional<EncodedScan> whole;
  for (const scan_t& part : parts) {
    const auto bytes = std::make_shared<const std::vector<std::byte>>(encoded(part));
    kept.push_back(bytes);
    whole = assembler.add(*bytes, bytes);
  }
  ASSERT_TRUE(whole);
  for (const auto& each : kept) EXPECT_FALSE(each.expired());
  EXPECT_EQ(whole->read().points.size(), 7'000U);
  whole.reset();
  for (const auto& each : kept) EXPECT_TRUE(each.expired());
}

TEST(SensorMessages, APartThatIsReadFromTheBusIsRefusedAsItsMessageIs) {
  const std::vector<std::byte> data = encoded(to_messages(scan_of(5)).front());
  ScanPart part;
  ASSERT_TRUE(decode_checked(data, part));
  EXPECT_EQ(part.part_count, 1);
  EXPECT_EQ(part.data.size(), data.size());
  EXPECT_FALSE(decode_checked(std::span(data).first(data.size() - 1), part));
}

INSTANTIATE_TEST_SUITE_P(Sizes, ScanParts, testing::Values(0, 1, 1080, 2900, 2901, 120'000));

}  // namespace
}  // namespace ignis::messages
