// SPDX-License-Identifier: Apache-2.0
#include "drivers/packet_stream.h"

#include <gtest/gtest.h>

#include "drivers/l1_samples.h"

namespace ignis::l1 {
namespace {

using samples::append;
using samples::Bytes;

DriverConfig by_counters() {
  DriverConfig config;
  config.time_source = "counters";
  return config;
}

template <class Kind>
std::vector<Kind> only(const std::vector<Packet>& packets) {
  std::vector<Kind> found;
  for (const Packet& packet : packets) {
    if (const auto* kind = std::get_if<Kind>(&packet)) found.push_back(*kind);
  }
  return found;
}

Bytes pair_bytes(std::uint16_t id, double sensor_time_s) {
  Auxiliary auxiliary = samples::auxiliary(id);
  auxiliary.time_s = static_cast<std::uint32_t>(sensor_time_s);
  auxiliary.time_us = static_cast<std::uint32_t>((sensor_time_s - auxiliary.time_s) * 1e6);
  Bytes bytes = samples::frame(kAuxiliaryId, auxiliary);
  append(bytes, samples::frame(kDistanceId, samples::distance(id)));
  return bytes;
}

TEST(PacketStream, GivesTheGoldenStreamInOrder) {
  PacketStream stream(by_counters());
  auto packets = stream.feed(samples::read_bytes("golden_clean.bin"), 0);
  const auto pairs = only<CountedPacket>(packets);
  const auto imu = only<CountedImu>(packets);
  ASSERT_EQ(pairs.size(), 36U);
  ASSERT_EQ(imu.size(), 50U);
  EXPECT_EQ(only<AuxiliarySeen>(packets).size(), 36U);
  EXPECT_EQ(only<Version>(packets).size(), 1U);
  EXPECT_EQ(only<TimeSync>(packets).size(), 1U);
  for (std::size_t i = 1; i < pairs.size(); ++i)
    EXPECT_EQ(pairs[i].count, pairs[0].count + static_cast<std::int64_t>(i));
  // The wire's ids run over 255 here, where trimming changes the length.
  for (std::size_t i = 1; i < imu.size(); ++i) EXPECT_EQ(imu[i].count, imu[0].count + static_cast<std::int64_t>(i));
  EXPECT_EQ(stream.counters().restarts, 0);
}

TEST(PacketStream, LeavesHolesInTheNumberingWherePairsAreLost) {
  PacketStream stream(by_counters());
  auto packets = stream.feed(samples::read_bytes("golden_faults.bin"), 0);
  for (Packet& packet : stream.finish()) packets.push_back(std::move(packet));
  std::vector<std::int64_t> missing;
  const auto pairs = only<CountedPacket>(packets);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    for (std::int64_t count = pairs[i - 1].count + 1; count < pairs[i].count; ++count) {
      missing.push_back(count - pairs[0].count);
    }
  }
  EXPECT_EQ(missing, (std::vector<std::int64_t>{3, 5, 11}));
}

TEST(PacketStream, TellsARestartBySensorTimeThatRunsBack) {
  PacketStream stream(by_counters());
  double time_s = 3600.0;
  std::uint16_t id = 500;
  for (int i = 0; i < 20; ++i) (void)stream.feed(pair_bytes(id++, time_s += 1.0 / 180.0), 0);
  EXPECT_EQ(stream.counters().restarts, 0);
  const auto packets = stream.feed(pair_bytes(0, 0.5), 0);
  EXPECT_EQ(only<CountersRestarted>(packets).size(), 1U);
  // The restart comes before what was counted anew.
  EXPECT_TRUE(std::holds_alternative<CountersRestarted>(packets.front()));
  EXPECT_EQ(stream.counters().restarts, 1);
  for (std::uint16_t i = 1; i < 20; ++i) (void)stream.feed(pair_bytes(i, 0.5 + i / 180.0), 0);
  EXPECT_EQ(stream.counters().restarts, 1);
  EXPECT_NEAR(stream.housekeeping().sensor_time_s, 0.5 + 19 / 180.0, 1e-6);
}

TEST(PacketStream, TellsARestartOfTheInertialCounterAfterALongSilence) {
  PacketStream stream(DriverConfig{});
  Utime now = 1'000'000;
  for (std::uint16_t id = 1000; id < 1100; ++id) {
    (void)stream.feed(samples::frame(kImuId, samples::imu(id)), now += 4000);
  }
  const auto packets = stream.feed(samples::frame(kImuId, samples::imu(2)), now += 3'000'000);
  EXPECT_EQ(only<CountersRestarted>(packets).size(), 1U);
  const auto imu = only<CountedImu>(packets);
  ASSERT_EQ(imu.size(), 1U);
  EXPECT_NEAR(static_cast<double>(imu[0].count), 1099.0 + 750.0, 1.0);
}

TEST(PacketStream, CountsThroughAWrapOfUnknownModulusWithoutARestart) {
  PacketStream stream(DriverConfig{});
  Utime now = 1'000'000;
  std::vector<CountedImu> imu;
  for (int i = 0; i < 3000; ++i) {
    const auto id = static_cast<std::uint16_t>((900 + i) % 1004);
    for (const CountedImu& each :
         only<CountedImu>(stream.feed(samples::frame(kImuId, samples::imu(id)), now += 4000))) {
      imu.push_back(each);
    }
  }
  ASSERT_EQ(imu.size(), 3000U);
  EXPECT_EQ(imu.back().count - imu.front().count, 2999);
  EXPECT_EQ(stream.counters().restarts, 0);
  EXPECT_EQ(stream.counters().imu_gaps, 0);
}

}  // namespace
}  // namespace ignis::l1
