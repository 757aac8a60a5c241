// SPDX-License-Identifier: Apache-2.0
#include "frontend/checkpoint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>

#include "common/byte_codec.h"
#include "common/byte_record.h"
#include "common/so3.h"
#include "frontend/lio_runner.h"

namespace ignis {
namespace {

using test::Drive;
using test::Sensors;

constexpr const char* kHash = "0123456789abcdef";

const Drive& drive() {
  static const Drive simulated =
      test::simulate(test::furnished_hall(), test::ellipse_drive(2.0, 6.0, 4.0, 2.0), 20.0, Sensors{}, 11);
  return simulated;
}

/// What a front end made of a stretch of a drive.
struct Stretch {
  std::vector<ScanResult> scans;
  std::vector<std::pair<Utime, Trust>> trust;
};

/// Feeds the data with from <= instant < to, in seconds since the drive's beginning. A scan counts by its first point:
/// one that began before a process was there is lost to it.
Stretch feed(Lio& lio, const Drive& input, double from, double to) {
  const Utime begin = input.imu.front().utime + to_micros(from);
  const Utime end = input.imu.front().utime + to_micros(to);
  Stretch stretch;
  const auto take = [&](std::vector<ScanResult> results) {
    for (ScanResult& result : results) {
      stretch.trust.emplace_back(result.stats.utime, lio.status().trust);
      stretch.scans.push_back(std::move(result));
    }
  };
  auto scan = std::ranges::lower_bound(input.scans, begin, {}, &Scan::utime);
  for (const ImuSample& sample : input.imu) {
    if (sample.utime < begin || sample.utime >= end) continue;
    for (; scan != input.scans.end() && scan->end_utime() + 2'000 <= sample.utime; ++scan) take(lio.add_scan(*scan));
    take(lio.add_imu(sample).scans);
  }
  return stretch;
}

Lio driven_until(double seconds, const Drive& input = drive()) {
  Lio lio(test::tuned_config());
  feed(lio, input, 0.0, seconds);
  EXPECT_TRUE(lio.can_be_resumed());
  return lio;
}

/// A successor of `lio`, by way of bytes.
Lio successor(const Lio& lio) {
  return start_from_checkpoint(test::tuned_config(), kHash, encode_checkpoint(lio, kHash));
}

double position_error(const ScanResult& scan, const Drive& input = drive()) {
  const Pose truth = input.truth(test::drive_seconds(input, scan.state.utime));
  return (scan.state.T_odom_body.translation - truth.translation).norm();
}

std::vector<std::byte> bytes_of(const auto& value) {
  std::vector<std::byte> bytes;
  ByteWriter writer(bytes);
  transfer(writer, value);
  return bytes;
}

TEST(Checkpoint, OfASessionThatHasEndedLeavesItsNumberAlone) {
  const Lio after = start_from_checkpoint(test::tuned_config(), "hash", encode_ended_session(4, "hash"));
  EXPECT_EQ(after.session(), 5);
  EXPECT_NE(after.start_note().find("its session has ended"), std::string::npos);
}

TEST(Checkpoint, AFrontEndThatWasReadBackGoesOnBitForBit) {
  for (const double at : {6.003, 9.502, 13.331}) {
    Lio original = driven_until(at);
    Lio copy(test::tuned_config());
    const std::vector<std::byte> bytes = bytes_of(original);
    ByteReader reader(bytes);
    transfer(reader, copy);
    ASSERT_TRUE(!reader.failed() && reader.at_end());
    ASSERT_EQ(bytes_of(copy), bytes);
    const Stretch expected = feed(original, drive(), at, at + 5.0);
    const Stretch actual = feed(copy, drive(), at, at + 5.0);
    ASSERT_EQ(actual.scans.size(), expected.scans.size());
    int keyframes = 0;
    for (std::size_t i = 0; i < expected.scans.size(); ++i) {
      ASSERT_EQ(actual.scans[i].stats.reason, expected.scans[i].stats.reason) << i;
      ASSERT_EQ(actual.scans[i].state.T_odom_body.translation, expected.scans[i].state.T_odom_body.translation) << i;
      ASSERT_EQ(actual.scans[i].covariance, expected.scans[i].covariance) << i;
      ASSERT_EQ(actual.scans[i].keyframe.has_value(), expected.scans[i].keyframe.has_value()) << i;
      if (!expected.scans[i].keyframe) continue;
      ++keyframes;
      ASSERT_EQ(bytes_of(*actual.scans[i].keyframe), bytes_of(*expected.scans[i].keyframe)) << i;
    }
    EXPECT_GT(keyframes, 1);
    EXPECT_EQ(actual.trust, expected.trust);
  }
}

TEST(Checkpoint, AResetLeavesNothingOfTheOldPlace) {
  Lio used = driven_until(8.0);
  used.reset();
  Lio fresh(test::tuned_config(), 1);
  feed(used, drive(), 0.0, 5.0);
  feed(fresh, drive(), 0.0, 5.0);
  EXPECT_TRUE(bytes_of(used) == bytes_of(fresh));
}

TEST(Checkpoint, TheFirstGoodPoseAfterAGapIsWhereTheVehicleIs) {
  for (const double at : {5.1, 8.4, 11.7, 15.2}) {
    for (const double gap : {0.2, 0.5, 1.0}) {
      Lio before = driven_until(at);
      Lio after = successor(before);
      EXPECT_EQ(after.status().trust, Trust::kDegraded);
      const Stretch stretch = feed(after, drive(), at + gap, at + gap + 2.5);
      const auto good = std::ranges::find_if(stretch.scans, [](const ScanResult& s) { return s.stats.applied(); });
      ASSERT_NE(good, stretch.scans.end()) << at << ' ' << gap;
      const Stretch last = feed(before, drive(), at, at + 0.1);
      const double step = std::abs(position_error(*good) - position_error(last.scans.back()));
      EXPECT_LT(step, 0.10) << at << ' ' << gap;
      EXPECT_LT(test::drive_seconds(drive(), good->stats.utime) - at - gap, 0.5) << at << ' ' << gap;
      EXPECT_EQ(after.status().trust, Trust::kOk) << at << ' ' << gap << ' ' << after.status().reason;
      EXPECT_EQ(after.session(), 0) << at << ' ' << gap;
    }
  }
}

TEST(Checkpoint, ItIsNeverOkBeforeTenScansHaveConfirmedIt) {
  Lio after = successor(driven_until(9.0));
  const Stretch stretch = feed(after, drive(), 9.4, 12.0);
  int applied = 0;
  for (std::size_t i = 0; i < stretch.scans.size(); ++i) {
    if (stretch.scans[i].stats.applied()) ++applied;
    if (applied < 10) {
      EXPECT_NE(stretch.trust[i].second, Trust::kOk) << i;
      EXPECT_FALSE(stretch.scans[i].keyframe) << i;
      EXPECT_FALSE(applied > 0 && after.can_be_resumed() && i + 1 == stretch.scans.size());
    }
  }
  EXPECT_GT(applied, 20);
  EXPECT_EQ(stretch.trust.back().second, Trust::kOk);
}

TEST(Checkpoint, TheChainOfKeyframesHasNeitherHoleNorRepeat) {
  std::map<std::int32_t, Keyframe> chain;
  Lio lio(test::tuned_config());
  const auto take = [&](const Stretch& stretch) {
    for (const ScanResult& scan : stretch.scans) {
      if (!scan.keyframe) continue;
      EXPECT_TRUE(chain.try_emplace(scan.keyframe->id, *scan.keyframe).second) << "repeated " << scan.keyframe->id;
    }
  };
  take(feed(lio, drive(), 0.0, 6.0));
  double now = 6.0;
  for (const double gap : {0.3, 0.6, 0.4}) {
    lio = successor(lio);
    take(feed(lio, drive(), now + gap, now + gap + 3.0));
    now += gap + 3.0;
  }
  int interrupted = 0;
  for (auto next = std::next(chain.begin()); next != chain.end(); ++next) {
    EXPECT_EQ(next->first, std::prev(next)->first + 1);
    EXPECT_EQ(next->second.previous_utime, std::prev(next)->second.state.utime);
    interrupted += next->second.imu_complete ? 0 : 1;
  }
  EXPECT_EQ(interrupted, 3);
  EXPECT_GT(chain.size(), 6U);
}

/// Prediction over the gap, unaided by scans, against the truth: an empty scan shows state and covariance.
TEST(Checkpoint, TheCovarianceOfThePredictionOverTheGapIsHonest) {
  double nees = 0.0;
  int runs = 0;
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    const Drive input = test::simulate(test::furnished_hall(), test::ellipse_drive(2.0, 6.0, 4.0, 1.5 + 0.25 * seed),
                                       14.0, Sensors{}, 100 + seed);
    for (const double at : {5.0, 7.5, 10.0}) {
      const Lio before = driven_until(at, input);
      for (const double gap : {0.1, 0.3, 0.6, 1.0}) {
        Lio after = successor(before);
        feed(after, input, at + gap, at + gap + 0.02);
        Scan empty;
        empty.utime = input.imu.front().utime + to_micros(at + gap);
        empty.duration_us = 10'000;
        const std::vector<ScanResult> results = after.add_scan(empty);
        ASSERT_EQ(results.size(), 1U);
        ASSERT_TRUE(results.front().has_state);
        const NavState& state = results.front().state;
        const double t = test::drive_seconds(input, state.utime);
        const Pose truth = input.truth(t);
        NavState exact = state;
        exact.T_odom_body = truth;
        exact.v_odom = (input.truth(t + 1e-4).translation - input.truth(t - 1e-4).translation) / 2e-4;
        const Eigen::Matrix<double, 9, 1> error = difference(state, exact).head<9>();
        const Eigen::Matrix<double, 9, 9> covariance = results.front().covariance.topLeftCorner<9, 9>();
        nees += error.dot(covariance.ldlt().solve(error)) / 9.0;
        ++runs;
      }
    }
  }
  EXPECT_LT(nees / runs, 1.5) << "the covariance claims too much";
  EXPECT_GT(nees / runs, 0.05) << "the covariance is useless";
}

TEST(Checkpoint, DataThatAreTooFarAheadOrBehindBeginANewSession) {
  const Lio before = driven_until(9.0);
  for (const double from : {13.0, 5.0}) {
    Lio after = successor(before);
    const Stretch stretch = feed(after, drive(), from, from + 0.5);
    EXPECT_EQ(after.session(), 1) << from;
    EXPECT_NE(after.status().reason.find("new session"), std::string::npos) << after.status().reason;
    EXPECT_NE(after.status().trust, Trust::kOk);
    for (const ScanResult& scan : stretch.scans) EXPECT_FALSE(scan.has_state);
  }
}

TEST(Checkpoint, AnotherPlaceIsNeverTakenForTheOldOne) {
  const Drive elsewhere = test::simulate(test::street(), test::ellipse_drive(2.0, 6.0, 4.0, 2.0), 16.0, Sensors{}, 12);
  Lio after = successor(driven_until(9.0));
  for (const auto& [utime, trust] : feed(after, elsewhere, 9.5, 16.0).trust) {
    EXPECT_TRUE(trust != Trust::kOk || after.session() > 0) << test::drive_seconds(elsewhere, utime);
  }
  EXPECT_GT(after.session(), 0);
}

TEST(Checkpoint, ASilentLidarAfterTheRestartEndsTheSession) {
  Drive blind = drive();
  blind.scans.clear();
  Lio after = successor(driven_until(9.0));
  feed(after, blind, 9.3, 12.0);
  EXPECT_EQ(after.session(), 1);
  EXPECT_NE(after.start_note().find("did not confirm"), std::string::npos) << after.start_note();
}

TEST(Checkpoint, AnotherConfigurationVersionOrAnOffSwitchBeginsANewSessionWithAReason) {
  const Lio before = driven_until(6.0);
  const std::vector<std::byte> bytes = encode_checkpoint(before, kHash);
  const Lio other_hash = start_from_checkpoint(test::tuned_config(), "another", bytes);
  EXPECT_EQ(other_hash.session(), 1);
  EXPECT_NE(other_hash.start_note().find("another configuration"), std::string::npos);
  FrontendConfig off = test::tuned_config();
  off.resume_max_gap_s = 0.0;
  EXPECT_NE(start_from_checkpoint(off, kHash, bytes).start_note().find("resume_max_gap_s"), std::string::npos);
  const Lio none = start_from_checkpoint(test::tuned_config(), kHash, {});
  EXPECT_TRUE(none.session() == 0 && none.start_note().empty());
}

/// True when the velocity was wrong at some time; never while the trust was OK.
bool was_wrong_in_motion(const Drive& cruise) {
  Lio lio(test::tuned_config(), 1, "new session: the checkpoint is not used");
  const Stretch stretch = feed(lio, cruise, 0.0, 6.9);
  bool was_wrong = false;
  for (std::size_t i = 0; i < stretch.scans.size(); ++i) {
    const ScanResult& scan = stretch.scans[i];
    if (!scan.has_state) continue;
    const bool is_wrong = std::abs(scan.state.v_odom.norm() - 1.5) > 0.5;
    was_wrong = was_wrong || is_wrong;
    EXPECT_FALSE(is_wrong && stretch.trust[i].second == Trust::kOk) << test::drive_seconds(cruise, scan.stats.utime);
  }
  return was_wrong;
}

TEST(Checkpoint, ANewSessionThatBeginsInMotionIsNotOkWhileItsVelocityIsWrong) {
  Drive cruise = test::simulate(test::furnished_hall(), test::straight_drive(0.0, 1.5), 7.0, Sensors{}, 13);
  EXPECT_FALSE(was_wrong_in_motion(cruise)) << "scans before the start tell the velocity";
  const Utime begin = cruise.imu.front().utime;
  std::erase_if(cruise.scans, [&](const Scan& scan) { return scan.utime < begin + to_micros(1.5); });
  EXPECT_FALSE(was_wrong_in_motion(cruise)) << "so do those that begin later";
  std::erase_if(cruise.scans,
                [&](const Scan& scan) { return scan.utime < begin + to_micros(2.8) && scan.sequence % 8; });
  EXPECT_TRUE(was_wrong_in_motion(cruise)) << "with three a second nobody tells it, else this test shows nothing";
}

/// A front end with a coarse map, whose checkpoint is small.
std::vector<std::byte> small_checkpoint(FrontendConfig& config) {
  config = test::tuned_config();
  config.voxel_size_m = 1.0;
  config.match_radius_m = 1.5;
  config.wide_match_radius_m = 0.0;
  config.max_range_m = 4.0;
  Lio lio(config);
  feed(lio, drive(), 0.0, 2.2);
  return encode_checkpoint(lio, kHash);
}

TEST(Checkpoint, DamageAtAnyByteIsNoticed) {
  FrontendConfig config;
  std::vector<std::byte> bytes = small_checkpoint(config);
  ASSERT_FALSE(start_from_checkpoint(config, kHash, bytes).can_be_resumed());
  ASSERT_EQ(start_from_checkpoint(config, kHash, bytes).session(), 0);
  ASSERT_EQ(start_from_checkpoint(config, kHash, bytes).start_note(), "going on with session 0");
  const std::size_t head = kRecordFrameBytes + record_at(bytes, 0).payload.size();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] ^= std::byte{0x40};
    const Lio lio = start_from_checkpoint(config, kHash, bytes);
    bytes[i] ^= std::byte{0x40};
    ASSERT_NE(lio.start_note().find("new session"), std::string::npos) << i << ": " << lio.start_note();
    ASSERT_FALSE(lio.status().running) << i;
    ASSERT_EQ(lio.session(), i < head ? 0 : 1) << i;
  }
}

/// Replaces a number wherever it stands in the bytes.
void replace_number(std::vector<std::byte>& bytes, double number, double by) {
  const auto old = std::bit_cast<std::array<std::byte, sizeof(double)>>(number);
  const auto other = std::bit_cast<std::array<std::byte, sizeof(double)>>(by);
  auto found = std::ranges::search(bytes, old);
  ASSERT_FALSE(found.empty());
  for (; !found.empty(); found = std::ranges::search(found.end(), bytes.end(), old.begin(), old.end())) {
    std::ranges::copy(other, found.begin());
  }
}

TEST(Checkpoint, AStateThatIsNoNumberIsNotSound) {
  Lio lio(test::tuned_config());
  const NavState state = feed(lio, drive(), 0.0, 6.0).scans.back().state;
  ASSERT_TRUE(lio.is_sound());
  for (const double number :
       {state.T_odom_body.rotation.x(), state.T_odom_body.translation.y(), state.v_odom.z(), state.gyro_bias.x(),
        state.accel_bias.y(), state.angular_rate.z(), state.gravity_tilt.x(), state.gravity_tilt.y()}) {
    std::vector<std::byte> bytes = bytes_of(lio);
    replace_number(bytes, number, std::nan(""));
    ByteReader reader(bytes);
    Lio damaged(test::tuned_config());
    transfer(reader, damaged);
    EXPECT_FALSE(damaged.is_sound()) << number;
  }
}

TEST(Checkpoint, ACheckpointThatWasCutShortIsNoticed) {
  FrontendConfig config;
  const std::vector<std::byte> bytes = small_checkpoint(config);
  for (std::size_t size = 1; size < bytes.size(); size += 7) {
    const Lio lio = start_from_checkpoint(config, kHash, std::span(bytes).first(size));
    ASSERT_NE(lio.start_note().find("new session"), std::string::npos) << size;
    ASSERT_FALSE(lio.status().running) << size;
  }
}

TEST(Checkpoint, AKeyframeSurvivesItsBytesAndDamageIsNoticed) {
  Lio lio(test::tuned_config());
  const Stretch stretch = feed(lio, drive(), 0.0, 5.0);
  const auto found =
      std::ranges::find_if(stretch.scans, [](const ScanResult& s) { return s.keyframe && s.keyframe->id > 0; });
  ASSERT_NE(found, stretch.scans.end());
  Keyframe keyframe = *found->keyframe;
  keyframe.cloud.resize(20);
  keyframe.imu.resize(20);
  std::vector<std::byte> bytes = encode_keyframe(keyframe);
  ASSERT_TRUE(decode_keyframe(bytes).has_value());
  EXPECT_EQ(bytes_of(*decode_keyframe(bytes)), bytes_of(keyframe));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] ^= std::byte{0x01};
    ASSERT_FALSE(decode_keyframe(bytes).has_value()) << i;
    bytes[i] ^= std::byte{0x01};
  }
}

}  // namespace
}  // namespace ignis
