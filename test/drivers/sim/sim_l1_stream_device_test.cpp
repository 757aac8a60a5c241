// SPDX-License-Identifier: Apache-2.0
//
// The simulated sensor as a device: what it does on a host's command, and when its power fails.

#include <gtest/gtest.h>

#include "common/config_check.h"
#include "drivers/sim/sim_rooms.h"

namespace ignis::sim {
namespace {

constexpr Utime kMillisecond = 1000;

std::vector<StreamFrame> only(const std::vector<StreamFrame>& frames, std::uint32_t id) {
  std::vector<StreamFrame> found;
  for (const StreamFrame& frame : frames) {
    if (frame.message_id == id) found.push_back(frame);
  }
  return found;
}

struct Order {
  Utime at;  ///< [us] given before the first frame that begins later
  HostCommand command;
};

/// All frames of a stream that is given the orders at their instants.
std::vector<StreamFrame> frames_with(L1Stream& stream, std::vector<Order> orders) {
  std::vector<StreamFrame> frames;
  auto order = orders.begin();
  while (auto frame = stream.next_frame()) {
    frames.push_back(std::move(*frame));
    for (; order != orders.end() && order->at <= frames.back().send_utime; ++order) {
      stream.obey(order->command, frames.back().send_utime);
    }
  }
  return frames;
}

std::vector<StreamFrame> frames_with(double seconds, std::vector<Order> orders, const DeviceConfig& device = {}) {
  L1Stream stream(room(), tilted_forward(), 1, seconds, device);
  return frames_with(stream, std::move(orders));
}

TEST(L1StreamDevice, SilentHostChangesNoByte) {
  L1Stream obeyed(room(), tilted_forward(), 1, 0.5);
  obeyed.obey(SyncAnswer{.count = 99}, 0);
  EXPECT_EQ(bytes_of(all_frames(obeyed)), bytes_of(frames_of(room(), 1, 0.5)));
}

TEST(L1StreamDevice, TellsItsVersionWhenAskedAndOnlyThenIfToldSo) {
  EXPECT_EQ(only(frames_with(1.0, {}, {.announces_version = false}), l1::kVersionId).size(), 0U);
  const auto answers =
      only(frames_with(1.0, {{300 * kMillisecond, VersionQuery{}}, {600 * kMillisecond, VersionQuery{}}},
                       {.announces_version = false}),
           l1::kVersionId);
  ASSERT_EQ(answers.size(), 2U);
  EXPECT_NEAR(static_cast<double>(answers[0].send_utime), 300e3, 10e3);
  // The vendor's library crashes on a version without the plus sign.
  EXPECT_NE(l1::decode_version(payload_of(answers[0])).sys_soft.find('+'), std::string::npos);
}

TEST(L1StreamDevice, AsksForTimeSyncAtOnceWhenTheHostWantsIt) {
  const auto requests = only(frames_with(3.0, {{200 * kMillisecond, SyncQuery{}}}), l1::kTimeSyncId);
  ASSERT_EQ(requests.size(), 3U);  // at 0.2 s, and then every second
  EXPECT_NEAR(static_cast<double>(requests[0].send_utime), 200e3, 10e3);
  EXPECT_NEAR(static_cast<double>(requests[1].send_utime), 1200e3, 10e3);
  for (std::uint32_t i = 0; i < requests.size(); ++i) {
    EXPECT_EQ(l1::decode_time_sync(payload_of(requests[i])).count, i);
    EXPECT_EQ(l1::decode_time_sync(payload_of(requests[i])).type, l1::TimeSync::kRequest);
  }
}

TEST(L1StreamDevice, ReportsTheRoundTripOfTheLatestAnswerAndKeepsIt) {
  L1Stream stream(room(), tilted_forward(), 1, 3.0);
  std::optional<std::uint32_t> expected;
  std::uint32_t initial = 0;
  int requests = 0;
  int checked = 0;
  while (const auto frame = stream.next_frame()) {
    if (frame->message_id == l1::kTimeSyncId && ++requests < 3) {
      const std::uint32_t count = l1::decode_time_sync(payload_of(*frame)).count;
      const auto round_trip = static_cast<std::uint32_t>(2500 * requests);
      stream.obey(SyncAnswer{count}, frame->send_utime + round_trip);
      expected = round_trip;
    }
    if (frame->message_id != l1::kAuxiliaryId) continue;
    const std::uint32_t reported = l1::decode_auxiliary(payload_of(*frame)).sync_delay_us;
    if (!expected) {
      initial = reported;
      continue;
    }
    EXPECT_EQ(reported, *expected);
    ++checked;
  }
  EXPECT_EQ(initial, 9000U);
  EXPECT_EQ(requests, 3);  // the third goes without an answer
  EXPECT_GT(checked, 400);
}

TEST(L1StreamDevice, DisbelievesAnswersToOtherRequests) {
  L1Stream stream(room(), tilted_forward(), 1, 2.0);
  while (const auto frame = stream.next_frame()) {
    if (frame->message_id == l1::kTimeSyncId) {
      const std::uint32_t count = l1::decode_time_sync(payload_of(*frame)).count;
      stream.obey(SyncAnswer{count + 1}, frame->send_utime + 500);
      stream.obey(SyncAnswer{count - 1}, frame->send_utime + 500);
    }
    if (frame->message_id != l1::kAuxiliaryId) continue;
    EXPECT_EQ(l1::decode_auxiliary(payload_of(*frame)).sync_delay_us, 9000U);
  }
}

/// Standby from 0.5 s, normal from 1.5 s, spin-up of 0.4 s.
class StandbyAndBack : public ::testing::Test {
 protected:
  static constexpr Utime kStandbyAt = 500 * kMillisecond;
  static constexpr Utime kNormalAt = 1500 * kMillisecond;
  static constexpr Utime kSpinUp = 400 * kMillisecond;
  std::vector<StreamFrame> frames_ = frames_with(
      3.0, {{kStandbyAt, ModeCommand{l1::WorkingMode::kStandby}}, {kNormalAt, ModeCommand{l1::WorkingMode::kNormal}}},
      {.spin_up_s = 0.4});
};

TEST_F(StandbyAndBack, StopsScansAndNothingElse) {
  for (const StreamFrame& frame : frames_) {
    if (frame.message_id != l1::kAuxiliaryId && frame.message_id != l1::kDistanceId) continue;
    const bool before = frame.send_utime < kStandbyAt + 5 * kMillisecond;
    const bool after = frame.measured_utime >= kNormalAt + kSpinUp;
    EXPECT_TRUE(before || after) << frame.send_utime;
  }
  const auto samples = only(frames_, l1::kImuId);
  EXPECT_EQ(samples.size(), 751U);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(samples[i].measured_utime, static_cast<Utime>(i) * 4000);
    EXPECT_EQ(l1::decode_imu(payload_of(samples[i])).packet_id, i);
  }
  EXPECT_EQ(only(frames_, l1::kTimeSyncId).size(), 3U);
}

TEST_F(StandbyAndBack, ResumesAfterTheSpinUpWithTheIdsThatFollow) {
  const auto auxiliaries = only(frames_, l1::kAuxiliaryId);
  const auto distances = only(frames_, l1::kDistanceId);
  ASSERT_EQ(auxiliaries.size(), distances.size());
  Utime resumed = 0;
  for (std::size_t i = 0; i < auxiliaries.size(); ++i) {
    const l1::Auxiliary packet = l1::decode_auxiliary(payload_of(auxiliaries[i]));
    EXPECT_EQ(packet.packet_id, i);
    EXPECT_EQ(l1::decode_distance(payload_of(distances[i])).packet_id, i);
    // Sensor time counts on through standby.
    EXPECT_EQ(packet.time_s * 1'000'000LL + packet.time_us, auxiliaries[i].measured_utime);
    if (i > 0 && auxiliaries[i].measured_utime - auxiliaries[i - 1].measured_utime > 100 * kMillisecond) {
      resumed = auxiliaries[i].measured_utime;
    }
  }
  EXPECT_NEAR(static_cast<double>(resumed), static_cast<double>(kNormalAt + kSpinUp), 5e3);
  EXPECT_NEAR(static_cast<double>(auxiliaries.size()), 0.5 * 180 + 1.1 * 180, 3.0);
}

TEST_F(StandbyAndBack, LosesNoFrameNumber) {
  std::uint8_t expected = 0;
  for (const StreamFrame& frame : frames_) EXPECT_EQ(static_cast<std::uint8_t>(frame.bytes[4]), expected++);
}

TEST(L1StreamDevice, RepeatedStandbyAndNormalCommandsChangeNothing) {
  const ModeCommand standby{l1::WorkingMode::kStandby};
  const ModeCommand normal{l1::WorkingMode::kNormal};
  const auto once = frames_with(2.0, {{500'000, standby}, {800'000, normal}}, {.spin_up_s = 0.2});
  const auto often = frames_with(
      2.0, {{100'000, normal}, {500'000, standby}, {600'000, standby}, {800'000, normal}, {900'000, normal}},
      {.spin_up_s = 0.2});
  EXPECT_EQ(bytes_of(once), bytes_of(often));
}

TEST(L1StreamDevice, FinishesTheScanWhoseAuxiliaryIsOut) {
  // Between AUX and DISTANCE the mode changes, or changes and changes back.
  for (const bool and_back : {false, true}) {
    L1Stream stream(room(), tilted_forward(), 1, 0.5, {.spin_up_s = 0.0});
    std::vector<StreamFrame> frames;
    bool ordered = false;
    while (auto frame = stream.next_frame()) {
      frames.push_back(std::move(*frame));
      if (ordered || frames.back().message_id != l1::kAuxiliaryId || frames.size() < 50) continue;
      ordered = true;
      stream.obey(ModeCommand{l1::WorkingMode::kStandby}, frames.back().send_utime);
      if (and_back) stream.obey(ModeCommand{l1::WorkingMode::kNormal}, frames.back().send_utime + 1);
    }
    const auto auxiliaries = only(frames, l1::kAuxiliaryId);
    const auto distances = only(frames, l1::kDistanceId);
    ASSERT_EQ(auxiliaries.size(), distances.size());
    if (and_back) {
      EXPECT_GT(auxiliaries.size(), 80U);
    } else {
      EXPECT_LT(auxiliaries.size(), 30U);
    }
    for (std::size_t i = 0; i < auxiliaries.size(); ++i) {
      EXPECT_EQ(l1::decode_auxiliary(payload_of(auxiliaries[i])).packet_id, i);
      EXPECT_EQ(l1::decode_distance(payload_of(distances[i])).packet_id, i);
      EXPECT_EQ(distances[i].measured_utime, auxiliaries[i].measured_utime);
    }
  }
}

TEST(L1StreamDevice, ShowsInItsStatusWhetherALightPatternRuns) {
  for (const auto& [mode, bit] : {std::pair{1, 0}, {2, 8}, {8, 8}}) {
    const auto frames = frames_with(0.5, {{0, LedCommand{static_cast<std::uint8_t>(mode)}}});
    EXPECT_EQ(l1::decode_auxiliary(payload_of(only(frames, l1::kAuxiliaryId).back())).work_status, bit);
  }
}

TEST(L1StreamDevice, CountsIdsWithItsModulus) {
  const auto frames = frames_of(room(), 1, 5.0, {.id_modulus = 100});
  std::size_t scans = 0;
  std::size_t samples = 0;
  for (const StreamFrame& frame : frames) {
    if (frame.message_id == l1::kAuxiliaryId) {
      EXPECT_EQ(l1::decode_auxiliary(payload_of(frame)).packet_id, scans % 100);
    } else if (frame.message_id == l1::kDistanceId) {
      EXPECT_EQ(l1::decode_distance(payload_of(frame)).packet_id, scans++ % 100);
    } else if (frame.message_id == l1::kImuId) {
      EXPECT_EQ(l1::decode_imu(payload_of(frame)).packet_id, samples++ % 100);
    }
  }
  EXPECT_GT(scans, 800U);
  EXPECT_GT(samples, 1000U);
}

TEST(L1StreamDevice, IsSilentAndStartsOverWhenThePowerFails) {
  const double off = 0.5;
  const auto frames = frames_of(room(), 1, 3.0, {.power_cycle_at_s = 1.0, .power_off_s = off});
  std::size_t first_after = 0;
  while (frames[first_after].send_utime < 1'000'000) ++first_after;
  EXPECT_GE(frames[first_after].send_utime, 1'500'000);
  EXPECT_LT(frames[first_after].send_utime, 1'501'000);
  const std::vector<StreamFrame> after(frames.begin() + static_cast<std::ptrdiff_t>(first_after), frames.end());
  const auto fresh = frames_of(room(), 1, 1.5);
  ASSERT_EQ(after.size(), fresh.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    EXPECT_EQ(after[i].message_id, fresh[i].message_id);
    EXPECT_EQ(after[i].bytes[4], fresh[i].bytes[4]);
    EXPECT_EQ(after[i].measured_utime - 1'500'000, fresh[i].measured_utime);
    if (after[i].message_id != l1::kAuxiliaryId) continue;
    const l1::Auxiliary packet = l1::decode_auxiliary(payload_of(after[i]));
    EXPECT_EQ(packet.packet_id, l1::decode_auxiliary(payload_of(fresh[i])).packet_id);
    EXPECT_EQ(packet.time_us, l1::decode_auxiliary(payload_of(fresh[i])).time_us);
  }
}

TEST(L1StreamDevice, ForgetsStandbyInAPowerCycleAndHearsNothingMeanwhile) {
  L1Stream stream(room(), tilted_forward(), 1, 3.0, {.power_cycle_at_s = 1.0, .power_off_s = 1.0});
  stream.obey(ModeCommand{l1::WorkingMode::kStandby}, 0);
  Utime first_scan = 0;
  bool ordered = false;
  while (const auto frame = stream.next_frame()) {
    if (!ordered && frame->send_utime >= 2'000'000) {
      ordered = true;
      stream.obey(ModeCommand{l1::WorkingMode::kStandby}, 1'500'000);
    }
    if (first_scan == 0 && frame->message_id == l1::kAuxiliaryId) first_scan = frame->measured_utime;
  }
  EXPECT_EQ(first_scan, 2'000'000);
  EXPECT_EQ(stream.mode(), l1::WorkingMode::kNormal);
}

TEST(L1StreamDevice, RefusesAnImpossibleDeviceNamingEachFault) {
  try {
    L1Stream stream(room(), tilted_forward(), 1, 1.0, {.id_modulus = 1, .spin_up_s = -1.0, .power_off_s = 1e9});
    FAIL() << "accepted";
  } catch (const config::ConfigError& error) {
    const std::string text = error.what();
    for (const char* field : {"device.id_modulus", "device.spin_up_s", "device.power_off_s"}) {
      EXPECT_NE(text.find(field), std::string::npos) << text;
    }
  }
}

}  // namespace
}  // namespace ignis::sim
