// SPDX-License-Identifier: Apache-2.0
//
// A driver that hangs: neither inertial samples nor scans come for a while, and the vehicle drives on.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "frontend/fault_drive.h"

namespace ignis {
namespace {

using test::Drive;
using test::drive;
using test::sample_at;

/// Each scan comes when the samples that cover it are there. Calls `look` after each.
void feed(Lio& lio, const Drive& input, const std::function<void(const ScanResult&)>& look) {
  auto scan = input.scans.begin();
  const auto show = [&](const std::vector<ScanResult>& results) { std::ranges::for_each(results, look); };
  for (const ImuSample& sample : input.imu) {
    show(lio.add_imu(sample).scans);
    for (; scan != input.scans.end() && scan->end_utime() <= sample.utime; ++scan) show(lio.add_scan(*scan));
  }
}

/// [m/s]
double speed_at_end(Lio& lio, const Drive& input) {
  ImuSample next = input.imu.back();
  next.utime += 4'000;
  const std::optional<NavState> state = lio.add_imu(next).state;
  return state ? state->v_odom.norm() : -1.0;
}

double true_speed_at_end(const Drive& input) {
  const double end = test::drive_seconds(input, input.imu.back().utime);
  return (input.truth(end).translation - input.truth(end - 0.1).translation).norm() / 0.1;
}

/// Neither samples nor scans of that time.
void cut(Drive& input, Utime from, Utime to) {
  std::erase_if(input.imu, [&](const ImuSample& sample) { return sample.utime >= from && sample.utime < to; });
  std::erase_if(input.scans, [&](const Scan& scan) { return scan.end_utime() >= from && scan.utime < to; });
}

TEST(Fault_P7, ADriverThatHangsInMotionCostsNoPlaceUpToTwoSecondsAndNeverAnUnannouncedError) {
  for (const double seconds : {0.25, 0.5, 1.0, 2.0, 2.9, 4.0}) {
    Drive input = drive();
    const Utime from = sample_at(input, 8.0)->utime;
    const Utime to = from + to_micros(seconds);
    cut(input, from, to);
    Lio lio(test::tuned_config());
    double error = 0.0;
    int unannounced = 0;
    bool was_lost = false;
    feed(lio, input, [&](const ScanResult& scan) {
      if (!scan.has_state) return;
      const Pose truth = drive().truth(test::drive_seconds(drive(), scan.stats.utime));
      error = (scan.state.T_odom_body.translation - truth.translation).norm();
      was_lost = was_lost || lio.status().trust == Trust::kLost || scan.stats.session > 0;
      unannounced += error > 0.5 && !was_lost && lio.status().trust == Trust::kOk ? 1 : 0;
    });
    EXPECT_EQ(unannounced, 0) << seconds;
    if (seconds <= 2.0) {
      EXPECT_LT(error, 0.3) << seconds;
    }
    if (seconds > 3.0) {
      EXPECT_NE(lio.start_note().find("neither IMU data nor scans"), std::string::npos);
    }
  }
}

/// A drive without data between 8 s and 8 s + `seconds`; a scan that had just ended waits for its samples if `waiting`.
Drive silent(double seconds, bool waiting) {
  Drive input = drive();
  const Utime from = sample_at(input, 8.0)->utime;
  const Utime to = from + to_micros(seconds);
  std::erase_if(input.imu, [&](const ImuSample& sample) { return sample.utime >= from && sample.utime < to; });
  std::erase_if(input.scans,
                [&](const Scan& scan) { return scan.end_utime() >= from + (waiting ? 50'000 : 0) && scan.utime < to; });
  return input;
}

TEST(Fault_P7, TheStateGoesOnOverASilenceOnceAndNotTwice) {
  for (const bool waiting : {false, true}) {
    const Drive input = silent(0.9, waiting);
    const Utime to = drive().imu.front().utime + to_micros(8.9);
    Lio lio(test::tuned_config());
    auto scan = input.scans.begin();
    std::optional<NavState> after;
    int refused = 0;
    int verdicts = 0;  // on the scan that waited, once the silence is over
    for (const ImuSample& sample : input.imu) {
      const ImuResult result = lio.add_imu(sample);
      for (const ScanResult& each : result.scans) refused += each.stats.reason == ScanReason::kNoImu ? 1 : 0;
      if (sample.utime >= to) {
        verdicts = static_cast<int>(result.scans.size());
        after = result.state;
        break;
      }
      for (; scan != input.scans.end() && scan->utime <= sample.utime; ++scan) (void)lio.add_scan(*scan);
    }
    ASSERT_TRUE(after.has_value());
    const Pose truth = drive().truth(test::drive_seconds(drive(), after->utime));
    EXPECT_LT((after->T_odom_body.translation - truth.translation).norm(), 0.4) << "0.9 s at 1.3 m/s, in a curve";
    EXPECT_EQ(refused, waiting ? 1 : 0) << "its samples never came";
    EXPECT_EQ(verdicts, refused) << "one scan, one verdict";
  }
}

TEST(Fault_P7, ASilenceBeforeTheFirstScanLosesNothing) {
  Drive input = silent(0.5, false);
  const Utime first = drive().imu.front().utime + to_micros(9.0);
  std::erase_if(input.scans, [&](const Scan& scan) { return scan.utime < first; });
  Lio lio(test::tuned_config());
  int applied = 0;
  feed(lio, input, [&](const ScanResult& scan) { applied += scan.stats.applied() ? 1 : 0; });
  EXPECT_EQ(lio.session(), 0);
  EXPECT_GT(applied, 50);
}

TEST(Fault_P7, ASilenceIsBridgedWhenARestartMayNotGoOn) {
  FrontendConfig config = test::tuned_config();
  config.resume_max_gap_s = 0.0;
  Lio lio(config);
  feed(lio, silent(0.5, false), [](const ScanResult&) {});
  EXPECT_EQ(lio.session(), 0);
}

/// A front end that has no time leaves out scans: ten of them take longer than two seconds to come.
TEST(Fault_P7, ASilenceIsBridgedByTheFewScansOfABusyFrontEnd) {
  Drive input = silent(0.5, false);
  const Utime from = drive().imu.front().utime + to_micros(6.0);
  std::erase_if(input.scans, [&](const Scan& scan) { return scan.utime > from && scan.sequence % 5 != 0; });
  Lio lio(test::tuned_config());
  feed(lio, input, [](const ScanResult&) {});
  EXPECT_EQ(lio.session(), 0) << lio.status().reason;
  EXPECT_EQ(lio.status().trust, Trust::kOk) << lio.status().reason;
}

/// Too short to be a silence: two samples, each as wrong as the vehicle shakes, stand for seventy.
TEST(Fault_P7, WhatTwoSamplesSayAcrossAGapTeachesTheBiasesNothing) {
  const Drive input = silent(0.28, false);
  const Utime to = drive().imu.front().utime + to_micros(8.28);
  Lio lio(test::tuned_config());
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  int behind = 0;
  feed(lio, input, [&](const ScanResult& scan) {
    if (scan.stats.utime < to) before = scan.state.accel_bias;
    if (scan.stats.utime < to || scan.stats.utime > to + 900'000) return;
    EXPECT_EQ(scan.state.accel_bias, before);
    ++behind;
  });
  EXPECT_GT(behind, 10);
}

/// What happened from 8 s to 8 s + `missed` is not in it, and its stamps tell of `told` seconds only.
Drive with_a_jump(Drive whole, double missed, double told) {
  const Utime from = whole.imu.front().utime + to_micros(8.0);
  const Utime to = from + to_micros(missed);
  const Utime early = to_micros(missed - told);
  cut(whole, from, to);
  for (ImuSample& sample : whole.imu) sample.utime -= sample.utime >= to ? early : 0;
  for (Scan& scan : whole.scans) scan.utime -= scan.utime >= to ? early : 0;
  return whole;
}

/// It came elsewhere than any model foretells: farther along a curve, and turned.
TEST(Fault_P7, APlaceThatOnlyLooksRightBehindASilenceIsNotTakenAndANewSessionBeginsInMotion) {
  constexpr double kMissed = 7.0;
  int begun = 0;
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const Drive whole = test::simulate(test::furnished_hall(), test::ellipse_drive(2.5, 6.0, 4.0, 1.3), 26.0, {}, seed);
    const Drive input = with_a_jump(whole, kMissed, 1.0);
    const Utime jump = whole.imu.front().utime + to_micros(8.0);
    Lio lio(test::tuned_config());
    int unannounced = 0;
    feed(lio, input, [&](const ScanResult& scan) {
      if (!scan.has_state || scan.stats.session > 0) return;
      const double late = scan.stats.utime > jump ? kMissed - 1.0 : 0.0;
      const Pose truth = whole.truth(test::drive_seconds(whole, scan.stats.utime) + late);
      const double error = (scan.state.T_odom_body.translation - truth.translation).norm();
      unannounced += error > 0.5 && lio.status().trust == Trust::kOk ? 1 : 0;
    });
    EXPECT_EQ(unannounced, 0) << "seed " << seed;
    if (lio.session() == 0) continue;
    ++begun;
    EXPECT_EQ(lio.status().trust, Trust::kOk) << lio.status().reason << ", seed " << seed;
    EXPECT_NEAR(speed_at_end(lio, input), true_speed_at_end(whole), 0.2) << "seed " << seed;
  }
  EXPECT_GT(begun, 1);
}

TEST(Fault_P7, BehindALongSilenceASessionBeginsInMotionToo) {
  Lio lio(test::tuned_config());
  feed(lio, silent(4.0, false), [&](const ScanResult&) {
    if (lio.session() == 0 || lio.status().running) return;
    EXPECT_NE(lio.status().text.find("waiting"), std::string::npos) << lio.status().text;
  });
  EXPECT_EQ(lio.session(), 1);
  ASSERT_TRUE(lio.status().running) << lio.status().reason;
  EXPECT_NEAR(speed_at_end(lio, drive()), true_speed_at_end(drive()), 0.2) << lio.status().reason;
}

/// The first sample behind the silence claims to be of the future; the next one takes its place.
TEST(Fault_P7, ABrokenStampBehindALongSilenceKeepsNoSessionFromBeginningInMotion) {
  const Drive input = silent(4.0, false);
  Lio lio(test::tuned_config());
  auto scan = input.scans.begin();
  for (const ImuSample& sample : input.imu) {
    const std::int32_t before = lio.session();
    (void)lio.add_imu(sample);
    if (lio.session() != before) {
      ImuSample broken = sample;
      broken.utime += 3'600'000'000;
      EXPECT_EQ(lio.add_imu(broken).fault, ImuFault::kNone) << "nothing is known yet that it could be held against";
    }
    for (; scan != input.scans.end() && scan->end_utime() <= sample.utime; ++scan) (void)lio.add_scan(*scan);
  }
  EXPECT_EQ(lio.session(), 1);
  EXPECT_TRUE(lio.status().running) << lio.status().reason;
}

/// Scans do not tell there how fast it goes. It stood before, and is not asked.
TEST(Fault_P7, BehindALongSilenceOfAVehicleThatStandsItBeginsAtRest) {
  Drive input = test::simulate(test::bare_corridor(), test::straight_drive(60.0, 1.0), 14.0, {}, 1);
  const Utime from = input.imu.front().utime + to_micros(5.0);
  const Utime to = from + to_micros(5.0);
  cut(input, from, to);
  Lio lio(test::tuned_config());
  feed(lio, input, [](const ScanResult&) {});
  EXPECT_EQ(lio.session(), 1);
  EXPECT_TRUE(lio.status().running) << lio.status().reason;
}

/// The same where the silence was short and nothing confirms the place behind it.
TEST(Fault_P7, AVehicleThatStandsWhereNoScanComesBeginsAtRestWithoutWaitingForAMotion) {
  Drive input = test::simulate(test::bare_corridor(), test::straight_drive(60.0, 1.0), 14.0, {}, 1);
  const Utime from = input.imu.front().utime + to_micros(5.0);
  const Utime to = from + to_micros(0.5);
  cut(input, from, to);
  std::erase_if(input.scans, [&](const Scan& scan) { return scan.utime >= from; });
  Lio lio(test::tuned_config());
  feed(lio, input, [](const ScanResult&) {});
  EXPECT_EQ(lio.session(), 1);
  EXPECT_TRUE(lio.status().running) << lio.status().reason;
}

/// Blind, and the accelerometer reads 5 m/s^2 too much: within 8 s it would go at 40 m/s.
TEST(Fault_P7, ALostVehicleThatSeemsToFlyBeginsAnew) {
  Drive input = drive();
  const Utime from = sample_at(input, 6.0)->utime;
  std::erase_if(input.scans, [&](const Scan& scan) { return scan.end_utime() >= from; });
  for (ImuSample& sample : input.imu) sample.accel.z() -= sample.utime >= from ? 5.0 : 0.0;
  Lio lio(test::tuned_config());
  double fastest = 0.0;
  for (auto scan = input.scans.begin(); const ImuSample& sample : input.imu) {
    const ImuResult result = lio.add_imu(sample);
    if (result.state) fastest = std::max(fastest, result.state->v_odom.norm());
    for (; scan != input.scans.end() && scan->end_utime() <= sample.utime; ++scan) (void)lio.add_scan(*scan);
  }
  EXPECT_EQ(lio.session(), 1);
  EXPECT_NE(lio.status().reason.find("cannot be"), std::string::npos) << lio.status().reason;
  EXPECT_GT(fastest, 20.0);
  EXPECT_LT(fastest, 42.0);
}

TEST(Fault_P7, AStampOfTheFarFutureWhileScansHaveYetToConfirmThePlaceEndsNothing) {
  const Drive input = silent(0.5, false);
  const Utime to = drive().imu.front().utime + to_micros(8.5);
  Lio lio(test::tuned_config());
  feed(lio, input, [&](const ScanResult& scan) {
    if (scan.stats.utime < to || scan.stats.utime > to + 200'000) return;
    ImuSample sample = input.imu.back();
    sample.utime += 3'600'000'000;
    EXPECT_NE(lio.add_imu(sample).fault, ImuFault::kNone);
  });
  EXPECT_EQ(lio.session(), 0);
}

}  // namespace
}  // namespace ignis
