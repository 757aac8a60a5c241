// SPDX-License-Identifier: Apache-2.0
//
// Faults of scans and stamps that the odometry has to survive, by their numbers in the fault list.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "frontend/fault_drive.h"

namespace ignis {
namespace {

using test::Drive;
using test::drive;
using test::sample_at;
using test::Watched;

TEST(Fault_F4, PointsThatAreNoNumbersLeaveTheResultBitIdentical) {
  Drive input = drive();
  constexpr float kBad[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30F};
  for (std::size_t i = 100; i < 200; ++i) {
    for (const float bad : kBad) {
      std::vector<ScanPoint>& points = input.scans[i].points;
      const std::size_t at = i * 7 % points.size();
      ScanPoint point = points[at];
      point.position[static_cast<Eigen::Index>(i % 3)] = bad;
      points.insert(points.begin() + static_cast<std::ptrdiff_t>(at), point);
    }
  }
  const Watched clean(drive());
  const Watched dirty(input);
  ASSERT_EQ(clean.scans.size(), dirty.scans.size());
  for (std::size_t i = 0; i < clean.scans.size(); ++i) {
    ASSERT_EQ(clean.scans[i].state.T_odom_body.translation, dirty.scans[i].state.T_odom_body.translation) << i;
    ASSERT_EQ(clean.scans[i].covariance, dirty.scans[i].covariance) << i;
  }
}

TEST(Fault_F6, ScansWithoutUsablePointsAreSkippedAndSoonLoseTheTrust) {
  Drive input = drive();
  const auto index_at = [&](double seconds) { return static_cast<std::size_t>(20.0 * seconds); };
  for (std::size_t i = index_at(8.0); i < index_at(10.5); ++i) {
    std::vector<ScanPoint>& points = input.scans[i].points;
    if (i % 3 == 0) points.clear();
    if (i % 3 == 1) points.resize(30);
    if (i % 3 == 2) {
      for (ScanPoint& point : points) point.position.setConstant(std::nanf(""));
    }
  }
  const Watched run(input);
  EXPECT_EQ(run.trust_at(7.9), Trust::kOk);
  EXPECT_EQ(run.trust_at(8.4), Trust::kDegraded);
  EXPECT_EQ(run.trust_at(10.3), Trust::kLost);
  EXPECT_EQ(run.trust.back().second, Trust::kOk);
  const auto skipped = std::ranges::count(run.scans, ScanReason::kTooFewPoints,
                                          [](const ScanResult& result) { return result.stats.reason; });
  EXPECT_EQ(skipped, 50);
  EXPECT_EQ(run.lio.session(), 0) << "the map is still there and the next scan fits it";
  EXPECT_LT(run.error_at_end(), 0.2) << "the prediction was 0.6 m off when the points came back";
}

TEST(Fault_F6, FourOfFiveSensorPointsMissingCostNoTrust) {
  Drive input = drive();
  for (Scan& scan : input.scans) {
    std::vector<ScanPoint> kept;
    for (std::size_t i = 0; i < scan.points.size(); i += 5) kept.push_back(scan.points[i]);
    scan.points = std::move(kept);
  }
  const Watched run(input);
  EXPECT_EQ(run.trust.back().second, Trust::kOk);
  EXPECT_LT(run.error_at_end(), 0.2);
}

TEST(Fault_F7, AScanOfAMillionPointsIsMatchedWithTheConfiguredNumber) {
  Drive input = drive();
  Scan& scan = input.scans[200];
  const std::vector<ScanPoint> once = scan.points;
  while (scan.points.size() < 1'000'000) scan.points.insert(scan.points.end(), once.begin(), once.end());
  scan.points.resize(1'000'000);
  FrontendConfig config = test::tuned_config();
  config.max_scan_points = 1000;
  config.scan_voxel_m = 0.05;
  const Watched run(input, config);
  const ScanResult& large =
      *std::ranges::find(run.scans, scan.end_utime(), [](const ScanResult& r) { return r.stats.utime; });
  EXPECT_TRUE(large.stats.applied());
  EXPECT_GT(large.stats.points, 900'000);
  EXPECT_LE(large.stats.matched, 1000);
  EXPECT_LE(large.cloud.size(), once.size());
  EXPECT_LT(run.error_at_end(), 0.2);
}

/// [s] of processor, at the best, for one of three scans of `points` points in a drive.
double cost_of_scan(std::size_t points) {
  Drive input = drive();
  Lio lio(test::tuned_config());
  auto imu = input.imu.begin();
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 220; ++i) {
    Scan& scan = input.scans[i];
    const bool is_large = i >= 200 && i < 203;
    if (is_large) {
      const std::vector<ScanPoint> once = scan.points;
      while (scan.points.size() < points) scan.points.insert(scan.points.end(), once.begin(), once.end());
      scan.points.resize(points);
    }
    for (; imu->utime <= scan.end_utime(); ++imu) (void)lio.add_imu(*imu);
    const std::clock_t begun = std::clock();
    std::vector<ScanResult> results = lio.add_scan(std::move(scan));
    for (; results.empty(); ++imu) results = lio.add_imu(*imu).scans;
    if (is_large) {
      least = std::min(least, static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC);
      EXPECT_EQ(explanation(results.front().stats).find("not looked at") == std::string::npos, points <= 150'000);
    }
    EXPECT_TRUE(results.front().stats.applied() || i < 100) << i;
  }
  return least;
}

TEST(Fault_F7, AScanOfMillionsCostsWhatOneOf150000DoesWithTheShippedSettings) {
  EXPECT_LT(cost_of_scan(2'900'000), 3.0 * cost_of_scan(150'000)) << "nineteen times without the bound";
}

TEST(Fault_F7, ScansTenTimesTooOftenAreRefusedByNameAndTheOthersKeepThePose) {
  Drive input = drive();
  std::vector<Scan> often;
  for (const Scan& scan : input.scans) {
    for (std::int32_t copy = 0; copy < 10; ++copy) {
      Scan& shifted = often.emplace_back(scan);
      shifted.utime += copy * 5'000;
      shifted.sequence = static_cast<std::int32_t>(often.size());
    }
  }
  input.scans = often;
  const Watched run(input);
  const auto refused = std::ranges::count_if(
      run.scans, [](const ScanResult& result) { return result.stats.reason == ScanReason::kTooOften; });
  EXPECT_GE(run.scans.size() + 1, often.size()) << "each scan has its verdict, but the last may wait for its samples";
  EXPECT_GT(refused, std::ssize(often) * 3 / 4);
  EXPECT_EQ(run.trust.back().second, Trust::kOk);
  EXPECT_EQ(run.lio.session(), 0);
  EXPECT_LT(run.error_at_end(), 0.2);
}

TEST(Fault_B3, ThePoseIsHeldByEveryFifthScanAndTheOthersHaveTheirVerdict) {
  const Watched all(drive());
  Lio lio(test::tuned_config());
  std::vector<ScanResult> verdicts;
  const auto left_out = [](const Scan& scan) { return scan.sequence > 60 && scan.sequence % 5 != 0; };
  auto imu = drive().imu.begin();
  NavState newest;
  for (const Scan& scan : drive().scans) {
    for (; imu != drive().imu.end() && imu->utime <= scan.end_utime() + 4'000; ++imu) (void)lio.add_imu(*imu);
    if (left_out(scan)) {
      verdicts.push_back(lio.refuse(scan, ScanReason::kBehind));
    } else if (const std::vector<ScanResult> results = lio.add_scan(scan); !results.empty()) {
      newest = results.back().state;
    }
  }
  ASSERT_GT(verdicts.size(), 100U);
  EXPECT_EQ(lio.status().trust, Trust::kOk) << lio.status().reason;
  const auto same = std::ranges::find(all.scans, newest.utime, [](const ScanResult& scan) { return scan.stats.utime; });
  ASSERT_NE(same, all.scans.end());
  EXPECT_LT(body_difference(same->state.T_odom_body, newest.T_odom_body).norm(), 0.03);
  const ScanStats& verdict = verdicts.back().stats;
  EXPECT_FALSE(verdicts.back().has_state || verdict.applied());
  EXPECT_NE(explanation(verdict).find("left out"), std::string::npos) << explanation(verdict);
}

TEST(Fault_F8, PointTimesThatAreUnsortedOrOutsideTheScanAreClamped) {
  Drive input = drive();
  for (std::size_t i = 100; i < input.scans.size(); ++i) {
    std::vector<ScanPoint>& points = input.scans[i].points;
    std::ranges::reverse(points);
    points[i % points.size()].dt_us = -5'000'000;
    points[(i + 300) % points.size()].dt_us = 2'000'000'000;
  }
  const Watched run(input);
  EXPECT_TRUE(run.scans.back().stats.applied());
  EXPECT_LT(run.error_at_end(), 0.2);
}

TEST(Fault_F8, AScanWithoutPointTimesIsTakenAsItIsAndSaysSo) {
  Drive input = drive();
  for (std::size_t i = 100; i < input.scans.size(); ++i) {
    for (ScanPoint& point : input.scans[i].points) point.dt_us = 0;
  }
  const Watched run(input);
  const ScanStats& stats = run.scans.back().stats;
  EXPECT_TRUE(stats.applied());
  EXPECT_NE(explanation(stats).find("not deskewed, its points are all of one instant"), std::string::npos);
  EXPECT_EQ(explanation(run.scans[90].stats).find("deskewed"), std::string::npos) << "these had some";
  EXPECT_LT(run.error_at_end(), 0.2);
}

TEST(Fault_F9, AStampOfTheFarFutureBlocksNothing) {
  Drive input = drive();
  ImuSample future = *sample_at(input, 8.0);
  future.utime += 3'600'000'000;
  Scan far = input.scans[170];
  far.utime += 3'600'000'000;
  input.imu.insert(sample_at(input, 8.0), future);
  input.scans.insert(input.scans.begin() + 170, far);
  const Watched run(input);
  EXPECT_EQ(run.lio.imu_counters().leaps, 1);
  EXPECT_EQ(
      std::ranges::count_if(run.scans, [](const ScanResult& r) { return r.stats.reason == ScanReason::kBadStamp; }), 1);
  EXPECT_TRUE(run.scans.back().stats.applied());
  EXPECT_LT(run.error_at_end(), 0.2);
}

TEST(Fault_F9, StampsOfTheFarFutureBeforeAllOthersLeaveTheResultBitIdentical) {
  const Drive& input = drive();
  const Watched run(input, test::tuned_config(), [&](Lio& lio) {
    Scan scan = input.scans.front();
    scan.utime += 7'200'000'000;
    EXPECT_TRUE(lio.add_scan(scan).empty()) << "nothing is known yet that speaks against it";
    ImuSample sample = input.imu.front();
    sample.utime += 3'600'000'000;
    EXPECT_EQ(lio.add_imu(sample).scans.size(), 1U) << "the scan is refused";
  });
  const Watched undisturbed(input);
  EXPECT_TRUE(run.scans.back().stats.applied());
  EXPECT_EQ(run.scans.back().state.T_odom_body.translation, undisturbed.scans.back().state.T_odom_body.translation);
  EXPECT_EQ(run.scans.back().covariance, undisturbed.scans.back().covariance);
}

}  // namespace
}  // namespace ignis
