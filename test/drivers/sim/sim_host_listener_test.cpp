// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/host_listener.h"

#include <cmath>

#include <gtest/gtest.h>

#include "common/config_check.h"

namespace ignis::sim {
namespace {

using Bytes = std::vector<std::byte>;

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes bytes;
  for (const Bytes& part : parts) bytes.insert(bytes.end(), part.begin(), part.end());
  return bytes;
}

Bytes hex(std::initializer_list<unsigned> values) {
  Bytes bytes;
  for (const unsigned value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

/// Captured from the vendor's SDK.
Bytes vendor_standby() { return hex({0xfd, 0x01, 0x00, 0x00, 0x00, 0x01, 0x01, 0x0e, 0x00, 0x00, 0x02, 0xed, 0x78}); }
Bytes vendor_version_request() {
  return hex({0xfd, 0x01, 0x00, 0x00, 0x00, 0x01, 0x01, 0x0b, 0x00, 0x00, 0x02, 0x44, 0x86});
}
Bytes vendor_sync_answer_7() {
  return hex({0xfd, 0x05, 0x00, 0x00, 0x01, 0x01, 0x01, 0x12, 0x00, 0x00, 0x07, 0x00, 0x00, 0x00, 0x02, 0x61, 0xde});
}
Bytes vendor_leds_off() {
  return hex({0xfd, 0x0b, 0x00, 0x00, 0x00, 0x01, 0x01, 0x0f, 0x00, 0x00, 0x00, 0x00,
              0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x01, 0x39, 0x7a});
}

Bytes request(unsigned value) { return l1::encode_frame(l1::kRequestDataId, hex({value}), 0); }
Bytes mode(unsigned value) { return l1::encode_frame(l1::kWorkingModeId, hex({value}), 0); }
Bytes led(std::uint8_t value) {
  l1::LedRing ring;
  ring.mode = value;
  return l1::encode_frame(l1::kLedId, l1::encode(ring), 0);
}

HostListener attentive() { return HostListener({}, 1); }

TEST(HostListener, UnderstandsTheFramesOfTheVendorsLibrary) {
  HostListener listener = attentive();
  const auto commands =
      listener.feed(joined({vendor_standby(), vendor_version_request(), vendor_sync_answer_7(), vendor_leds_off()}));
  ASSERT_EQ(commands.size(), 4U);
  ASSERT_TRUE(std::holds_alternative<ModeCommand>(commands[0]));
  EXPECT_EQ(std::get<ModeCommand>(commands[0]).mode, l1::WorkingMode::kStandby);
  EXPECT_TRUE(std::holds_alternative<VersionQuery>(commands[1]));
  ASSERT_TRUE(std::holds_alternative<SyncAnswer>(commands[2]));
  EXPECT_EQ(std::get<SyncAnswer>(commands[2]).count, 7U);
  ASSERT_TRUE(std::holds_alternative<LedCommand>(commands[3]));
  EXPECT_EQ(std::get<LedCommand>(commands[3]).mode, 1);
}

TEST(HostListener, UnderstandsAQueryForTimeSyncAndTheWayBackToNormal) {
  HostListener listener = attentive();
  const auto commands = listener.feed(joined({request(1), mode(1), led(8)}));
  ASSERT_EQ(commands.size(), 3U);
  EXPECT_TRUE(std::holds_alternative<SyncQuery>(commands[0]));
  EXPECT_EQ(std::get<ModeCommand>(commands[1]).mode, l1::WorkingMode::kNormal);
  EXPECT_EQ(std::get<LedCommand>(commands[2]).mode, 8);
}

TEST(HostListener, PutsACommandTogetherFromSingleBytes) {
  HostListener listener = attentive();
  std::vector<HostCommand> commands;
  for (const std::byte byte : vendor_standby()) {
    EXPECT_TRUE(commands.empty());
    commands = listener.feed(std::span(&byte, 1));
  }
  EXPECT_EQ(commands.size(), 1U);
}

TEST(HostListener, CountsByKindWhatItWasTold) {
  HostListener listener = attentive();
  (void)listener.feed(
      joined({request(2), request(2), request(2), request(1), vendor_sync_answer_7(), vendor_sync_answer_7(), mode(2),
              mode(1), mode(2), mode(1), led(1), led(2), led(3), led(4), led(5)}));
  const HostCounters counters = listener.counters();
  EXPECT_EQ(counters.version_queries, 3);
  EXPECT_EQ(counters.sync_queries, 1);
  EXPECT_EQ(counters.sync_answers, 2);
  EXPECT_EQ(counters.mode_commands, 4);
  EXPECT_EQ(counters.led_commands, 5);
  EXPECT_EQ(counters.unknown + counters.ignored + counters.forbidden + counters.broken_frames, 0);
}

TEST(HostListener, CountsWhatASensorHasNoUseForAndDoesNothing) {
  HostListener listener = attentive();
  const Bytes reboot = l1::encode_frame(l1::kCommandId, hex({2}), 0);
  const Bytes imu = l1::encode_frame(l1::kImuId, l1::encode(l1::ImuAttitude{}), 0);
  const Bytes sync_request = l1::encode_frame(l1::kTimeSyncId, l1::encode(l1::TimeSync{7, l1::TimeSync::kRequest}), 0);
  const auto commands =
      listener.feed(joined({reboot, imu, sync_request, request(3), mode(0), mode(3), led(0), led(9)}));
  EXPECT_TRUE(commands.empty());
  EXPECT_EQ(listener.counters().unknown, 8);
}

TEST(HostListener, CountsMessagesThatOverwriteTheCalibration) {
  HostListener listener = attentive();
  EXPECT_TRUE(listener
                  .feed(joined({l1::encode_frame(123, Bytes(61, std::byte{1}), 0),
                                l1::encode_frame(124, Bytes(44, std::byte{1}), 1)}))
                  .empty());
  EXPECT_EQ(listener.counters().forbidden, 2);
  EXPECT_EQ(listener.counters().unknown, 0);
}

TEST(HostListener, CountsBrokenBytesAndHearsTheCommandBehindThem) {
  HostListener listener = attentive();
  Bytes broken = vendor_standby();
  broken[10] = std::byte{1};
  const auto commands = listener.feed(joined({hex({1, 2, 3}), broken, mode(2)}));
  EXPECT_EQ(commands.size(), 1U);
  EXPECT_EQ(listener.counters().broken_frames, 1);
  EXPECT_EQ(listener.counters().skipped_bytes, 3 + 13);
}

TEST(HostListener, LetsTheAskedShareOfModeAndLedCommandsPassUnheard) {
  HostListener listener({.ignore_commands = 0.3}, 5);
  constexpr int kEach = 2000;
  std::size_t heard = 0;
  for (int i = 0; i < kEach; ++i) heard += listener.feed(joined({mode(2), led(2)})).size();
  // Four standard deviations of the binomial count.
  EXPECT_NEAR(static_cast<double>(heard), 0.7 * 2 * kEach, 4.0 * std::sqrt(2 * kEach * 0.3 * 0.7));
  const HostCounters counters = listener.counters();
  EXPECT_EQ(counters.ignored + counters.mode_commands + counters.led_commands, 2 * kEach);
  EXPECT_EQ(counters.mode_commands + counters.led_commands, static_cast<std::int64_t>(heard));
}

TEST(HostListener, NeverIgnoresQueriesAndAnswers) {
  HostListener listener({.ignore_commands = 1.0}, 1);
  EXPECT_EQ(listener.feed(joined({request(2), request(1), vendor_sync_answer_7(), mode(2), led(2)})).size(), 3U);
}

TEST(HostListener, RefusesAShareOutsideZeroToOne) {
  EXPECT_THROW(HostListener(DeviceConfig{.ignore_commands = -0.1}, 1), config::ConfigError);
  EXPECT_THROW(HostListener(DeviceConfig{.ignore_commands = 1.1}, 1), config::ConfigError);
  EXPECT_THROW(HostListener(DeviceConfig{.ignore_commands = std::nan("")}, 1), config::ConfigError);
}

}  // namespace
}  // namespace ignis::sim
