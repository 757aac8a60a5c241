// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/byte_faults.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "common/config_check.h"
#include "drivers/l1_decoder.h"
#include "drivers/sim/sim_rooms.h"

namespace ignis::sim {
namespace {

using Bytes = std::vector<std::byte>;

/// 10 s of the sensor, about 6,000 frames; made once.
const std::vector<StreamFrame>& long_stream() {
  static const std::vector<StreamFrame> frames = [] {
    SceneConfig scene = room();
    scene.trajectory.waypoints[0].rest_s = 10.0;
    return frames_of(scene, 1, 10.0);
  }();
  return frames;
}

FaultConfig with(std::initializer_list<std::pair<Fault, double>> rates) {
  FaultConfig config;
  for (const auto& [fault, rate] : rates) config.rate(fault) = rate;
  return config;
}

std::vector<Delivery> all_deliveries(ByteFaults& faults, const std::vector<StreamFrame>& frames) {
  std::vector<Delivery> deliveries;
  const auto add = [&](std::vector<Delivery> more) {
    deliveries.insert(deliveries.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  };
  for (const StreamFrame& frame : frames) add(faults.pass(frame));
  add(faults.finish());
  return deliveries;
}

Bytes bytes_of(const std::vector<Delivery>& deliveries) {
  Bytes bytes;
  for (const Delivery& each : deliveries) bytes.insert(bytes.end(), each.bytes.begin(), each.bytes.end());
  return bytes;
}

Bytes damaged(const FaultConfig& config, std::uint64_t seed = 1) {
  ByteFaults faults(config, seed);
  return bytes_of(all_deliveries(faults, long_stream()));
}

/// Frames as the driver finds them.
std::vector<l1::Frame> parsed(const Bytes& bytes) {
  l1::FrameParser parser;
  parser.feed(bytes, 0);
  parser.finish();
  std::vector<l1::Frame> frames;
  while (auto frame = parser.next()) frames.push_back(std::move(*frame));
  return frames;
}

TEST(ByteFaults, ChangeNothingWithoutRatesAndDeliverWhenTheLastByteHasLeftTheWire) {
  ByteFaults faults({}, 1);
  const auto deliveries = all_deliveries(faults, long_stream());
  ASSERT_EQ(deliveries.size(), long_stream().size());
  for (std::size_t i = 0; i < deliveries.size(); ++i) {
    ASSERT_EQ(deliveries[i].bytes, long_stream()[i].bytes);
    ASSERT_EQ(deliveries[i].utime, long_stream()[i].send_utime + std::ssize(deliveries[i].bytes) * 5);
  }
  EXPECT_TRUE(faults.injected().empty());
}

TEST(ByteFaults, StrikeAsOftenAsTheirRatesSay) {
  for (std::size_t i = 0; i < kFaultCount; ++i) {
    const auto fault = static_cast<Fault>(i);
    for (const double rate : {0.01, 0.3}) {
      ByteFaults faults(with({{fault, rate}}), 7);
      (void)all_deliveries(faults, long_stream());
      const auto n = static_cast<double>(long_stream().size());
      // Four standard deviations of the binomial count.
      EXPECT_NEAR(static_cast<double>(faults.count(fault)), n * rate, 4.0 * std::sqrt(n * rate * (1.0 - rate)))
          << name_of(fault);
      EXPECT_EQ(std::ssize(faults.injected()), faults.count(fault));
    }
  }
}

TEST(ByteFaults, GiveTheSameBytesForTheSameSeedOnly) {
  const FaultConfig config = with({{Fault::kDrop, 0.01}, {Fault::kFlip, 0.01}, {Fault::kJunk, 0.01}});
  EXPECT_EQ(damaged(config, 3), damaged(config, 3));
  EXPECT_NE(damaged(config, 3), damaged(config, 4));
}

TEST(ByteFaults, DropTakesOutExactlyTheListedFrames) {
  ByteFaults faults(with({{Fault::kDrop, 0.05}}), 1);
  const Bytes bytes = bytes_of(all_deliveries(faults, long_stream()));
  std::set<std::int64_t> dropped;
  for (const InjectedFault& each : faults.injected()) dropped.insert(each.frame);
  Bytes expected;
  auto listed = faults.injected().begin();
  for (std::size_t i = 0; i < long_stream().size(); ++i) {
    if (dropped.contains(static_cast<std::int64_t>(i))) {
      EXPECT_EQ(listed->offset, std::ssize(expected));
      ++listed;
      continue;
    }
    expected.insert(expected.end(), long_stream()[i].bytes.begin(), long_stream()[i].bytes.end());
  }
  EXPECT_EQ(bytes, expected);
}

TEST(ByteFaults, FlipTurnsOverOneBitOfTheListedFrames) {
  ByteFaults faults(with({{Fault::kFlip, 0.05}}), 1);
  const Bytes bytes = bytes_of(all_deliveries(faults, long_stream()));
  const Bytes clean = sim::bytes_of(long_stream());
  ASSERT_EQ(bytes.size(), clean.size());
  std::vector<std::int64_t> places;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const int bits = std::popcount(std::to_integer<unsigned>(bytes[i] ^ clean[i]));
    ASSERT_LE(bits, 1);
    if (bits == 1) places.push_back(static_cast<std::int64_t>(i));
  }
  ASSERT_EQ(places.size(), faults.injected().size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const InjectedFault& listed = faults.injected()[i];
    const auto size = std::ssize(long_stream()[static_cast<std::size_t>(listed.frame)].bytes);
    EXPECT_GE(places[i], listed.offset);
    EXPECT_LT(places[i], listed.offset + size);
  }
}

TEST(ByteFaults, CutLeavesAPartOfTheListedFrames) {
  ByteFaults faults(with({{Fault::kCut, 0.05}}), 1);
  const auto deliveries = all_deliveries(faults, long_stream());
  auto listed = faults.injected().begin();
  for (std::size_t i = 0; i < deliveries.size(); ++i) {
    const Bytes& whole = long_stream()[i].bytes;
    const Bytes& sent = deliveries[i].bytes;
    if (listed != faults.injected().end() && listed->frame == static_cast<std::int64_t>(i)) {
      EXPECT_LT(sent.size(), whole.size());
      EXPECT_GE(sent.size(), 1U);
      ++listed;
    } else {
      EXPECT_EQ(sent.size(), whole.size());
    }
    EXPECT_TRUE(std::equal(sent.begin(), sent.end(), whole.begin()));
  }
}

TEST(ByteFaults, DuplicateSendsTheListedFramesTwice) {
  ByteFaults faults(with({{Fault::kDuplicate, 1.0}}), 1);
  const auto deliveries = all_deliveries(faults, long_stream());
  ASSERT_EQ(deliveries.size(), 2 * long_stream().size());
  for (std::size_t i = 0; i < deliveries.size(); ++i) EXPECT_EQ(deliveries[i].bytes, long_stream()[i / 2].bytes);
}

TEST(ByteFaults, NeverBringMoreBytesThanTheLineCarries) {
  ByteFaults faults(with({{Fault::kDrop, 0.02}, {Fault::kDuplicate, 0.2}, {Fault::kReorder, 0.1}, {Fault::kJunk, 0.1}}),
                    1);
  Utime line_free = 0;
  for (const Delivery& each : all_deliveries(faults, long_stream())) {
    EXPECT_GE(each.utime, line_free + std::ssize(each.bytes) * 5 - 1);
    line_free = each.utime;
  }
}

TEST(ByteFaults, ReorderSwapsNeighboursAndLosesNone) {
  ByteFaults faults(with({{Fault::kReorder, 0.1}}), 1);
  const auto deliveries = all_deliveries(faults, long_stream());
  ASSERT_EQ(deliveries.size(), long_stream().size());
  std::vector<std::size_t> order(deliveries.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  // The list names, for each swap, the frame that fell back; swaps of one frame follow each other.
  std::map<std::int64_t, int> falls;
  for (const InjectedFault& each : faults.injected()) ++falls[each.frame];
  for (const auto& [frame, places] : falls) {
    const auto at = std::ranges::find(order, static_cast<std::size_t>(frame));
    std::rotate(at, at + 1, at + 1 + places);
  }
  for (std::size_t i = 0; i < order.size(); ++i) {
    ASSERT_EQ(deliveries[i].bytes, long_stream()[order[i]].bytes) << i;
    ASSERT_GE(deliveries[i].utime, deliveries[i > 0 ? i - 1 : 0].utime);
  }
}

TEST(ByteFaults, StallHoldsEverythingAndThenLetsItGoInOneBurst) {
  FaultConfig config = with({{Fault::kStall, 0.001}});
  config.stall_ms = 150;
  ByteFaults faults(config, 1);
  const auto deliveries = all_deliveries(faults, long_stream());
  ASSERT_FALSE(faults.injected().empty());
  Utime held_until = 0;
  auto listed = faults.injected().begin();
  for (std::size_t i = 0; i < deliveries.size(); ++i) {
    const Utime due = long_stream()[i].end_utime();
    if (listed != faults.injected().end() && listed->frame == static_cast<std::int64_t>(i)) {
      held_until = due + 150'000;
      ++listed;
    }
    EXPECT_EQ(deliveries[i].utime, std::max(due, held_until));
    EXPECT_EQ(deliveries[i].bytes, long_stream()[i].bytes);
  }
}

TEST(ByteFaults, JunkComesBetweenWholeFrames) {
  ByteFaults faults(with({{Fault::kJunk, 0.05}}), 1);
  const auto deliveries = all_deliveries(faults, long_stream());
  EXPECT_EQ(deliveries.size(), long_stream().size() + faults.injected().size());
  std::int64_t offset = 0;
  std::int64_t frame = -1;
  auto listed = faults.injected().begin();
  for (const Delivery& each : deliveries) {
    const bool is_junk = listed != faults.injected().end() && listed->offset == offset;
    if (is_junk) {
      EXPECT_EQ(listed->frame, frame);
      EXPECT_GE(each.bytes.size(), 16U);
      EXPECT_LE(each.bytes.size(), 1024U);
      ++listed;
    } else {
      ++frame;
      EXPECT_EQ(each.bytes, long_stream()[static_cast<std::size_t>(frame)].bytes);
    }
    offset += std::ssize(each.bytes);
  }
}

/// What the driver makes of damage: per fault at most one frame is lost, nothing altered is believed.
class DamagedStream : public ::testing::TestWithParam<Fault> {};

TEST_P(DamagedStream, CostsAtMostTheFrameThatWasHit) {
  ByteFaults faults(with({{GetParam(), 0.05}}), 11);
  const auto survivors = parsed(bytes_of(all_deliveries(faults, long_stream())));
  const std::int64_t lost = std::ssize(long_stream()) - std::ssize(survivors);
  EXPECT_GT(faults.count(GetParam()), 200);
  const bool hits_a_frame = GetParam() == Fault::kDrop || GetParam() == Fault::kFlip || GetParam() == Fault::kCut;
  if (hits_a_frame) {
    EXPECT_LE(lost, faults.count(GetParam()));
  } else if (GetParam() == Fault::kJunk) {
    EXPECT_LE(static_cast<double>(lost), 0.02 * static_cast<double>(faults.count(GetParam())));
  } else if (GetParam() == Fault::kDuplicate) {
    EXPECT_EQ(lost, -faults.count(GetParam()));
  } else {
    EXPECT_EQ(lost, 0);
  }
}

TEST_P(DamagedStream, GivesNoAlteredFrame) {
  using Identity = std::tuple<std::uint32_t, std::uint8_t, Bytes>;
  std::multiset<Identity> sent;
  for (const l1::Frame& frame : parsed(sim::bytes_of(long_stream()))) {
    sent.emplace(frame.id, frame.sequence, frame.payload);
  }
  for (const l1::Frame& frame : parsed(damaged(with({{GetParam(), 0.05}}), 11))) {
    ASSERT_TRUE(sent.contains({frame.id, frame.sequence, frame.payload})) << frame.id;
  }
}

struct Published {
  std::vector<std::array<double, 6>> samples;  ///< rate and force, sorted
  std::vector<std::array<float, 3>> points;    ///< sorted
  std::vector<Utime> sample_stamps;
  std::vector<Utime> scan_stamps;
};

Published published(const std::vector<Delivery>& deliveries) {
  l1::L1Decoder decoder({}, tilted_forward());
  Published result;
  const auto take = [&](const std::vector<l1::Event>& events) {
    for (const l1::Event& event : events) {
      if (const auto* sample = std::get_if<ImuSample>(&event)) {
        result.sample_stamps.push_back(sample->utime);
        result.samples.push_back({sample->gyro.x(), sample->gyro.y(), sample->gyro.z(), sample->accel.x(),
                                  sample->accel.y(), sample->accel.z()});
        continue;
      }
      const Scan& scan = std::get<Scan>(event);
      result.scan_stamps.push_back(scan.utime);
      for (const ScanPoint& point : scan.points) {
        result.points.push_back({point.position.x(), point.position.y(), point.position.z()});
      }
    }
  };
  for (const Delivery& each : deliveries) take(decoder.feed(each.bytes, each.utime));
  take(decoder.finish());
  std::ranges::sort(result.samples);
  std::ranges::sort(result.points);
  return result;
}

const Published& clean_publication() {
  static const Published clean = [] {
    ByteFaults none({}, 1);
    return published(all_deliveries(none, long_stream()));
  }();
  return clean;
}

TEST_P(DamagedStream, IsPublishedUnalteredWithStampsThatIncrease) {
  ByteFaults faults(with({{GetParam(), 0.05}}), 11);
  const Published& clean = clean_publication();
  const Published rest = published(all_deliveries(faults, long_stream()));
  EXPECT_GT(rest.samples.size(), 0.9 * static_cast<double>(clean.samples.size()));
  EXPECT_TRUE(std::ranges::includes(clean.samples, rest.samples));
  EXPECT_TRUE(std::ranges::includes(clean.points, rest.points));
  for (const auto* stamps : {&rest.sample_stamps, &rest.scan_stamps}) {
    for (std::size_t i = 1; i < stamps->size(); ++i) ASSERT_GT((*stamps)[i], (*stamps)[i - 1]);
  }
}

INSTANTIATE_TEST_SUITE_P(EachFault, DamagedStream,
                         ::testing::Values(Fault::kDrop, Fault::kFlip, Fault::kCut, Fault::kDuplicate, Fault::kStall,
                                           Fault::kReorder, Fault::kJunk),
                         [](const auto& param_info) { return name_of(param_info.param); });

TEST(FaultRates, AreReadFromTexts) {
  FaultConfig config;
  config::Offences offences;
  read_fault_rates({"drop=0.5", "junk=1e-3"}, config, offences);
  EXPECT_TRUE(offences.empty());
  EXPECT_EQ(config.rate(Fault::kDrop), 0.5);
  EXPECT_EQ(config.rate(Fault::kJunk), 1e-3);
  EXPECT_EQ(config.rate(Fault::kFlip), 0.0);
  EXPECT_FALSE(config.none());
  EXPECT_TRUE(FaultConfig{}.none());
}

TEST(FaultRates, AreRefusedAllAtOnce) {
  FaultConfig config;
  config::Offences offences;
  read_fault_rates({"melt=0.1", "drop", "flip=often", "cut=0.1x", "junk=0.1", "junk=0.2", "stall="}, config, offences);
  ASSERT_EQ(offences.size(), 6U);
  EXPECT_NE(config::describe(offences).find("melt=0.1"), std::string::npos);
}

TEST(FaultRates, OutsideZeroToOneAreRefusedByName) {
  try {
    FaultConfig config = with({{Fault::kDrop, -0.1}, {Fault::kFlip, 1.5}});
    config.stall_ms = 0;
    ByteFaults faults(config, 1);
    FAIL() << "accepted";
  } catch (const config::ConfigError& error) {
    const std::string text = error.what();
    for (const char* field : {"fault.drop", "fault.flip", "fault.stall_ms"}) {
      EXPECT_NE(text.find(field), std::string::npos) << text;
    }
  }
}

}  // namespace
}  // namespace ignis::sim
