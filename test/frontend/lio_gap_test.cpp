// SPDX-License-Identifier: Apache-2.0
//
// Seconds without scans while the IMU goes on: a plug, a cloud of dust, a lens that is wiped. Behind them the map lies
// a metre from where the prediction has it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "frontend/lio_runner.h"

namespace ignis {
namespace {

using test::Drive;
using test::LioRun;

constexpr double kGapBegin = 12.0;  // s
constexpr double kGapEnd = 17.0;

Drive with_a_gap(const test::World& world, const test::Trajectory& truth, std::uint32_t seed) {
  test::Sensors sensors;
  sensors.range_sigma = 0.02;
  Drive drive = test::simulate(world, truth, 22.0, sensors, seed);
  const Utime begin = drive.imu.front().utime;
  std::erase_if(drive.scans, [&](const Scan& scan) {
    return scan.utime > begin + to_micros(kGapBegin) && scan.utime < begin + to_micros(kGapEnd);
  });
  return drive;
}

TEST(LioGap, BehindAGapThePlaceIsFoundOrDoubted) {
  int found = 0;
  for (std::uint32_t seed = 1; seed <= 6; ++seed) {
    const Drive drive = with_a_gap(test::furnished_hall(), test::ellipse_drive(2.5, 6.0, 4.0, 1.0), seed);
    const LioRun run = test::run_lio(test::tuned_config(), drive);
    EXPECT_LT(test::worst_silent_error(run, drive), 0.15) << "seed " << seed;
    found += test::end_error(run, drive) < 0.15 ? 1 : 0;
  }
  EXPECT_GE(found, 3) << "none without the search";
}

const ScanResult& first_behind_the_gap(const LioRun& run, const Drive& drive) {
  return *std::ranges::find_if(run.scans, [&](const ScanResult& scan) {
    return scan.stats.applied() && test::drive_seconds(drive, scan.state.utime) > kGapEnd;
  });
}

TEST(LioGap, WhatWasKnownBeforeWasKnownOfThePredictedPlace) {
  int doubtful = 0;
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    const Drive drive = with_a_gap(test::bays(), test::straight_drive(2.5, 1.0), seed);
    const LioRun run = test::run_lio(test::tuned_config(), drive);
    const ScanResult& first = first_behind_the_gap(run, drive);
    if (first.stats.unobserved.empty()) continue;
    ++doubtful;
    const double before = 0.55;  // m, sigma of five seconds without scans
    const auto after = std::ranges::upper_bound(run.states, first.state.utime, {}, &NavState::utime);
    const double predicted = std::prev(after)->T_odom_body.translation.z();
    const double step = 0.9 * (first.state.T_odom_body.translation.z() - predicted);
    EXPECT_GT(first.covariance(kPosition + 2, kPosition + 2), before * before + step * step) << "seed " << seed;
  }
  EXPECT_GT(doubtful, 2);
}

/// Scans of the first `late` seconds are missing.
Drive with_late_scans(Drive drive, double late) {
  const Utime begin = drive.imu.front().utime;
  std::erase_if(drive.scans, [&](const Scan& scan) { return scan.utime < begin + to_micros(late); });
  return drive;
}

TEST(LioGap, ScansThatBeginSecondsAfterTheStartAreBehindNoGap) {
  const Drive whole = test::simulate(test::furnished_hall(), test::ellipse_drive(4.5, 6.0, 4.0, 1.0), 10.0, {}, 1);
  const Drive drive = with_late_scans(whole, 3.4);
  const LioRun run = test::run_lio(test::tuned_config(), drive);
  EXPECT_EQ(run.scans.back().trust, Trust::kOk) << run.status.reason;
  for (const ScanResult& scan : run.scans) {
    EXPECT_EQ(scan.stats.unobserved.find("place"), std::string::npos) << scan.stats.unobserved;
  }
}

TEST(LioGap, AVehicleThatStandsUntilScansComeIsWhereItBeganAndSure) {
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const Drive whole =
        test::simulate(test::furnished_hall(), test::ellipse_drive(25.0, 6.0, 4.0, 1.0), 30.0, {}, seed);
    for (const double late : {2.0, 8.0, 22.0}) {
      const Drive drive = with_late_scans(whole, late);
      const LioRun run = test::run_lio(test::tuned_config(), drive);
      const auto first = std::ranges::find_if(run.scans, &ScanResult::has_state);
      ASSERT_NE(first, run.scans.end());
      EXPECT_LT(first->state.T_odom_body.translation.norm(), 0.15) << late << " s, seed " << seed;
      const Eigen::Matrix3d covariance = first->covariance.block<3, 3>(kPosition, kPosition);
      EXPECT_LT(std::sqrt(covariance.diagonal().maxCoeff()), 0.1) << late << " s, seed " << seed;
      EXPECT_EQ(std::next(first, 20)->trust, Trust::kOk) << late << " s, seed " << seed;
      EXPECT_LT(test::end_error(run, drive), 0.15) << late << " s, seed " << seed;
    }
  }
}

TEST(LioGap, AVehicleThatRollsWhenScansComeLateGoesOnAtItsSpeed) {
  for (const double speed : {0.3, 0.5, 1.0}) {
    for (std::uint32_t seed = 1; seed <= 3; ++seed) {
      const Drive whole = test::simulate(test::furnished_hall(), test::straight_drive(0.0, speed), 9.0, {}, seed);
      const Drive drive = with_late_scans(whole, 3.0);
      const LioRun run = test::run_lio(test::tuned_config(), drive);
      EXPECT_NEAR(run.scans.back().state.v_odom.norm(), speed, 0.05) << run.status.reason << ", seed " << seed;
    }
  }
}

TEST(LioGap, AVehicleThatLeavesBeforeScansComeIsNotTakenForStanding) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    const Drive whole = test::simulate(test::furnished_hall(), test::ellipse_drive(4.0, 6.0, 4.0, 1.0), 16.0, {}, seed);
    const Drive drive = with_late_scans(whole, 11.0);
    const LioRun run = test::run_lio(test::tuned_config(), drive);
    const auto first = std::ranges::find_if(run.scans, &ScanResult::has_state);
    ASSERT_NE(first, run.scans.end());
    const Eigen::Vector3d truth = drive.truth(test::drive_seconds(drive, first->state.utime)).translation;
    const Eigen::Vector3d error = first->state.T_odom_body.translation - truth;
    const Eigen::Matrix3d covariance = first->covariance.block<3, 3>(kPosition, kPosition);
    EXPECT_LT(error.dot(covariance.inverse() * error), 25.0) << error.transpose() << ", seed " << seed;
  }
}

TEST(LioGap, NothingIsResumedFromBeforeTheFirstScan) {
  const Drive whole = test::simulate(test::furnished_hall(), test::ellipse_drive(9.0, 6.0, 4.0, 1.0), 4.0, {}, 1);
  Lio lio(test::tuned_config());
  for (const ImuSample& sample : whole.imu) static_cast<void>(lio.add_imu(sample));
  EXPECT_TRUE(lio.status().running);
  EXPECT_FALSE(lio.can_be_resumed()) << "without a map";
}

TEST(LioGap, AmongBaysThatLookAlikeThePoseIsNotToldToBeBetterThanItIs) {
  int wrong = 0;
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    const Drive drive = with_a_gap(test::bays(), test::straight_drive(2.5, 1.0), seed);
    const LioRun run = test::run_lio(test::tuned_config(), drive);
    EXPECT_LT(test::worst_silent_error(run, drive), 0.5) << "seed " << seed;
    const double error = test::end_error(run, drive);
    wrong += error > 0.5 ? 1 : 0;
    const Eigen::Matrix3d covariance = run.scans.back().covariance.block<3, 3>(kPosition, kPosition);
    EXPECT_LT(error, 4.0 * std::sqrt(covariance.diagonal().maxCoeff())) << "seed " << seed;
  }
  EXPECT_GT(wrong, 0) << "else nothing would be tested";
}

}  // namespace
}  // namespace ignis
