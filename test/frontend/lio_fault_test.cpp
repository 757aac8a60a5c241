// SPDX-License-Identifier: Apache-2.0
//
// Faults of the streams that the odometry has to survive, by their numbers in the fault list.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "frontend/fault_drive.h"

namespace ignis {
namespace {

using test::Drive;
using test::drive;
using test::sample_at;
using test::Sensors;
using test::Watched;

/// Position error over its predicted sigma, per degree of freedom, mean over the scans after `seconds`.
double position_nees(const Watched& run, double seconds) {
  double sum = 0.0;
  int count = 0;
  for (const ScanResult& scan : run.scans) {
    const double t = scan.has_state ? test::drive_seconds(drive(), scan.state.utime) : 0.0;
    if (t < seconds) continue;
    const Eigen::Vector3d error = drive().truth(t).translation - scan.state.T_odom_body.translation;
    sum += error.dot(scan.covariance.block<3, 3>(kPosition, kPosition).inverse() * error) / 3.0;
    ++count;
  }
  return sum / count;
}

TEST(Fault_F1, ShortImuGapsAreBridgedCountedAndCovered) {
  for (const double gap : {0.02, 0.05, 0.1}) {
    Drive input = drive();
    for (const double at : {6.0, 8.0, 10.0, 12.0}) input.imu.erase(sample_at(input, at), sample_at(input, at + gap));
    const Watched run(input);
    EXPECT_EQ(run.lio.imu_counters().gaps, 4) << gap;
    EXPECT_EQ(run.lio.session(), 0);
    for (const auto& [utime, trust] : run.trust) EXPECT_NE(trust, Trust::kLost);
    EXPECT_LT(run.error_at_end(), 0.2) << gap;
    EXPECT_LT(position_nees(run, 6.0), 9.35 / 3.0) << "97.5 % of chi-square with 3 degrees of freedom, one drive";
  }
}

TEST(Fault_F2, ImuGoneForThreeSecondsIsBridgedByScansAndAnnounced) {
  Drive input = drive();
  input.imu.erase(sample_at(input, 8.0), sample_at(input, 11.0));
  const Watched run(input);
  EXPECT_EQ(run.trust_at(7.9), Trust::kOk);
  EXPECT_EQ(run.trust_at(8.2), Trust::kDegraded);
  EXPECT_EQ(run.trust_at(10.9), Trust::kDegraded);
  EXPECT_EQ(run.trust_at(12.2), Trust::kOk) << "ten scans and the settling of the filter after its return";
  EXPECT_GT(run.lio.imu_counters().coasted, 200);
  EXPECT_LT(run.error_at_end(), 0.3) << "2 % of the 3 m in the gap, and the tilt of the start";
  for (const ScanResult& scan : run.scans) {
    if (scan.keyframe && scan.state.utime > sample_at(input, 8.3)->utime &&
        scan.state.utime < sample_at(input, 10.9)->utime) {
      EXPECT_FALSE(scan.keyframe->imu_complete) << "made-up samples are no measurement";
    }
  }
}

TEST(Fault_F3, AClippedAxisTeachesTheBiasesNothing) {
  Drive input = drive();
  for (auto sample = sample_at(input, 8.0); sample != sample_at(input, 8.1); ++sample) {
    sample->accel.x() = 25.0;
    sample->saturated = true;
  }
  const Watched run(input);
  const auto state_at = [&](double seconds) {
    const Utime utime = input.imu.front().utime + to_micros(seconds);
    return std::ranges::lower_bound(run.scans, utime, {}, [](const ScanResult& r) { return r.stats.utime; })->state;
  };
  EXPECT_EQ((state_at(9.0).accel_bias - state_at(7.95).accel_bias).norm(), 0.0);
  EXPECT_EQ((state_at(9.0).gravity_tilt - state_at(7.95).gravity_tilt).norm(), 0.0);
  EXPECT_GT((state_at(9.5).accel_bias - state_at(7.95).accel_bias).norm(), 0.0) << "one second later it learns again";
  for (const auto& [utime, trust] : run.trust) EXPECT_NE(trust, Trust::kLost);
  EXPECT_LT(run.error_at_end(), 0.3);
}

TEST(Fault_F3, TheScanThatCorrectsAWrongVelocityIsDeskewedWithTheRightOne) {
  Drive input = drive();
  for (auto sample = sample_at(input, 8.0); sample != sample_at(input, 8.1); ++sample) {
    sample->accel.x() = 25.0;
    sample->saturated = true;
  }
  const Watched clean(drive());
  const Watched clipped(input);
  ASSERT_EQ(clean.scans.size(), clipped.scans.size());
  for (std::size_t i = 162; i < clean.scans.size(); ++i) {  // the first behind the clipped samples
    const std::vector<CloudPoint>& expected = clean.scans[i].cloud;
    const std::vector<CloudPoint>& actual = clipped.scans[i].cloud;
    ASSERT_EQ(expected.size(), actual.size()) << i;
    Eigen::Vector3f shift = Eigen::Vector3f::Zero();
    for (std::size_t k = 0; k < expected.size(); ++k) shift += actual[k].position - expected[k].position;
    EXPECT_LT(shift.norm() / static_cast<float>(std::max<std::size_t>(expected.size(), 1)), 0.015F)
        << "scan " << i << "; 25 ms at the 1.3 m/s that the velocity was off by are 33 mm";
  }
}

TEST(Fault_F3, AVelocityThatIsNotKnownMovesThePositionAtTheScansEnd) {
  Drive input = drive();
  for (auto sample = sample_at(input, 8.0); sample != sample_at(input, 8.1); ++sample) {
    sample->accel.x() = 25.0;
    sample->saturated = true;
  }
  const Watched run(input);
  // A scan tells the position at the mean instant of its points, so what is not known of the velocity adds to that of
  // its end: their covariance is the mean age of the points times the velocity's variance.
  const ScanResult& scan = run.scans[160];
  const double velocity_variance = scan.covariance(kVelocity, kVelocity);
  ASSERT_GT(velocity_variance, 1.0) << "m^2/s^2: the clipped axis has cost it";
  EXPECT_NEAR(scan.covariance(kPosition, kVelocity) / velocity_variance, 0.025, 0.005) << "s";
}

constexpr std::size_t kWhileClipped = 160;  // scan

Drive clipped_drive() {
  Drive input = drive();
  for (auto sample = sample_at(input, 8.0); sample != sample_at(input, 8.1); ++sample) {
    sample->accel.x() = 25.0;
    sample->saturated = true;
  }
  return input;
}

TEST(Fault_F3, AScanThatIsRefusedLeavesNoDriftInTheMap) {
  Drive input = clipped_drive();
  for (ScanPoint& point : input.scans[kWhileClipped].points) point.position *= 0.3F;
  const Watched refused(input);
  ASSERT_FALSE(refused.scans[kWhileClipped].stats.applied());
  input.scans.erase(input.scans.begin() + kWhileClipped);
  const Watched absent(input);
  const auto variance = [](const Watched& run) {
    return run.scans.back().covariance.block<3, 3>(kPosition, kPosition).trace();
  };
  EXPECT_NEAR(variance(refused) / variance(absent), 1.0, 0.1);
}

TEST(Fault_F3, AScanThatIsRefusedSaysNothingOfTheVelocityThatTheMapWasMadeWith) {
  Drive input = clipped_drive();
  for (ScanPoint& point : input.scans[kWhileClipped].points) point.position *= 0.3F;
  const Watched run(input);
  ASSERT_EQ(run.scans[kWhileClipped].stats.reason, ScanReason::kTooFewMatches)
      << "in the middle of the hall there is nothing";
  const ScanResult& next = run.scans[kWhileClipped + 1];
  ASSERT_TRUE(next.stats.applied());
  const double velocity_variance = next.covariance(kVelocity, kVelocity);
  ASSERT_GT(velocity_variance, 1.0) << "m^2/s^2: the clipped axis has cost it";
  EXPECT_NEAR(next.covariance(kPosition, kVelocity) / velocity_variance, 0.025, 0.005)
      << "s; as if the map had been made with the velocity of the scan that it did not take";
}

/// Half a sine of 20 ms, 8 s after the beginning, with these peaks [m/s^2, rad/s]: 60 are 0.8 m/s, 8 are 0.1 rad.
Watched struck(double accel, double gyro) {
  Drive input = drive();
  const auto begin = sample_at(input, 8.0);
  for (auto sample = begin; sample != sample_at(input, 8.02); ++sample) {
    const double phase = 1e-6 * static_cast<double>(sample->utime - begin->utime) / 0.02;
    sample->accel.x() += accel * std::sin(std::numbers::pi * phase);
    sample->gyro.y() += gyro * std::sin(std::numbers::pi * phase);
  }
  return Watched(input);
}

void expect_harmless(const Watched& run) {
  int refused = 0;
  for (const ScanResult& scan : run.scans) {
    EXPECT_EQ(scan.stats.session, run.scans.front().stats.session);
    refused += test::drive_seconds(drive(), scan.stats.utime) > 8.0 && !scan.stats.applied() ? 1 : 0;
  }
  EXPECT_LE(refused, 2);
  for (const auto& [utime, trust] : run.trust) EXPECT_NE(trust, Trust::kLost);
  EXPECT_LT(run.error_at_end(), 0.3);
  const auto after = [&](double seconds) {
    const Utime utime = drive().imu.front().utime + to_micros(seconds);
    return std::ranges::lower_bound(run.scans, utime, {}, [](const ScanResult& r) { return r.stats.utime; })->state;
  };
  EXPECT_EQ((after(8.95).accel_bias - after(8.05).accel_bias).norm(), 0.0);
  EXPECT_EQ((after(8.95).gyro_bias - after(8.05).gyro_bias).norm(), 0.0);
}

TEST(Fault_F3, AShockCostsNeitherThePlaceNorTheSession) { expect_harmless(struck(60.0, 8.0)); }

TEST(Fault_F3, AShockThatOnlyTheAccelerometerFeelsCostsNothingEither) { expect_harmless(struck(60.0, 0.0)); }

TEST(Fault_F3, AShockThatOnlyTheGyroFeelsCostsNothingEither) { expect_harmless(struck(0.0, 8.0)); }

TEST(Fault_F3, StandingAfterAClippedSampleTeachesTheBiasesNothingEither) {
  Drive input = test::simulate(test::furnished_hall(), test::straight_drive(20.0, 0.5), 12.0, Sensors{}, 3);
  auto clipped = sample_at(input, 8.0);
  clipped->accel.x() = 25.0;
  clipped->saturated = true;
  const Watched run(input);
  const auto state_at = [&](double seconds) {
    const Utime utime = input.imu.front().utime + to_micros(seconds);
    return std::ranges::lower_bound(run.scans, utime, {}, [](const ScanResult& r) { return r.stats.utime; })->state;
  };
  EXPECT_EQ((state_at(8.95).gyro_bias - state_at(8.05).gyro_bias).norm(), 0.0);
  EXPECT_GT((state_at(9.6).gyro_bias - state_at(8.05).gyro_bias).norm(), 0.0) << "one second later it learns again";
}

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
  const Drive input = drive();
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
