// SPDX-License-Identifier: Apache-2.0
//
// Faults of the inertial stream that the odometry has to survive, by their numbers in the fault list.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "frontend/fault_drive.h"

namespace ignis {
namespace {

using test::Drive;
using test::drive;
using test::sample_at;
using test::Sensors;
using test::Watched;

/// The scan that ends so long after the beginning, or the next one. All drives begin at the same instant.
const ScanResult& scan_at(const Watched& run, double seconds) {
  const Utime utime = drive().imu.front().utime + to_micros(seconds);
  return *std::ranges::lower_bound(run.scans, utime, {}, [](const ScanResult& r) { return r.stats.utime; });
}

/// The same drive with one axis of the accelerometer at its limit for so long, 8 s after the beginning.
Drive with_clipped_axis(Drive input, double seconds) {
  for (auto sample = sample_at(input, 8.0); sample != sample_at(input, 8.0 + seconds); ++sample) {
    sample->accel.x() = 25.0;
    sample->saturated = true;
  }
  return input;
}

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

/// [m] What the position at `seconds` is off by, in the frame of the start.
Eigen::Vector3d position_error(const Watched& run, double seconds) {
  const NavState& state = scan_at(run, seconds).state;
  return state.T_odom_body.translation - drive().truth(test::drive_seconds(drive(), state.utime)).translation;
}

TEST(Fault_F2, AnImuGapOfAnyLengthIsToldWithin100MsAndCostsAFiftiethOfTheWay) {
  const Watched undisturbed(drive());
  for (const double gap : {0.15, 0.5, 1.0, 2.0, 5.0}) {
    Drive input = drive();
    input.imu.erase(sample_at(input, 8.0), sample_at(input, 8.0 + gap));
    const Watched run(input);
    EXPECT_EQ(run.lio.imu_counters().gaps, 1) << gap;
    EXPECT_EQ(run.trust_at(8.11), Trust::kDegraded) << gap << " s; the scan at 8.1 s is the last before";
    EXPECT_EQ(run.trust_at(8.0 + gap + 0.55), Trust::kOk) << gap << " s; ten scans after its return";
    EXPECT_EQ(run.lio.session(), 0);
    const auto drift_of = [gap](const Watched& each) {
      return (position_error(each, 8.0 + gap) - position_error(each, 7.95)).norm();
    };
    const double way = gap * 1.0;  // m, at 1 m/s
    EXPECT_LT(drift_of(run), drift_of(undisturbed) + 0.02 * way + 0.01)
        << gap << " s; the second pose is off by a centimetre as well";
  }
}

TEST(Fault_F3, AClippedAxisTeachesTheBiasesNothing) {
  const Drive input = with_clipped_axis(drive(), 0.1);
  const Watched run(input);
  const auto state_at = [&](double seconds) { return scan_at(run, seconds).state; };
  EXPECT_EQ((state_at(9.0).accel_bias - state_at(7.95).accel_bias).norm(), 0.0);
  EXPECT_EQ((state_at(9.0).gravity_tilt - state_at(7.95).gravity_tilt).norm(), 0.0);
  EXPECT_GT((state_at(9.5).accel_bias - state_at(7.95).accel_bias).norm(), 0.0) << "one second later it learns again";
  for (const auto& [utime, trust] : run.trust) EXPECT_NE(trust, Trust::kLost);
  EXPECT_LT(run.error_at_end(), 0.3);
}

TEST(Fault_F3, TheBiasesAreWithinThreeSigmaTenSecondsAfterAClippedAxis) {
  const Sensors sensors;
  const Drive whole = test::simulate(test::furnished_hall(), test::ellipse_drive(2.0, 6.0, 4.0, 1.0), 19.0, sensors, 7);
  for (const double seconds : {0.005, 0.05, 0.2}) {
    const Drive input = with_clipped_axis(whole, seconds);
    const Watched run(input);
    for (const auto& [utime, trust] : run.trust) EXPECT_NE(trust, Trust::kLost);
    const ScanResult& scan = scan_at(run, 18.0 + seconds);
    const auto in_sigmas = [&scan](const Eigen::Vector3d& error, int at) {
      return error.cwiseQuotient(scan.covariance.diagonal().segment<3>(at).cwiseSqrt()).cwiseAbs().maxCoeff();
    };
    EXPECT_LT(in_sigmas(scan.state.gyro_bias - sensors.gyro_bias, kGyroBias), 3.0) << seconds << " s";
    EXPECT_LT(in_sigmas(scan.state.accel_bias - sensors.accel_bias, kAccelBias), 3.0) << seconds << " s";
    EXPECT_LT(scan.covariance(kAccelBias, kAccelBias), 0.03 * 0.03) << "and that says something";
  }
}

TEST(Fault_F3, TheScanThatCorrectsAWrongVelocityIsDeskewedWithTheRightOne) {
  const Drive input = with_clipped_axis(drive(), 0.1);
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
  const Drive input = with_clipped_axis(drive(), 0.1);
  const Watched run(input);
  // A scan tells the position at the mean instant of its points, so what is not known of the velocity adds to that of
  // its end: their covariance is the mean age of the points times the velocity's variance.
  const ScanResult& scan = run.scans[160];
  const double velocity_variance = scan.covariance(kVelocity, kVelocity);
  ASSERT_GT(velocity_variance, 1.0) << "m^2/s^2: the clipped axis has cost it";
  EXPECT_NEAR(scan.covariance(kPosition, kVelocity) / velocity_variance, 0.025, 0.005) << "s";
}

constexpr std::size_t kWhileClipped = 160;  // scan

TEST(Fault_F3, AScanThatIsRefusedLeavesNoDriftInTheMap) {
  Drive input = with_clipped_axis(drive(), 0.1);
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
  Drive input = with_clipped_axis(drive(), 0.1);
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
  const auto after = [&](double seconds) { return scan_at(run, seconds).state; };
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
  const auto state_at = [&](double seconds) { return scan_at(run, seconds).state; };
  EXPECT_EQ((state_at(8.95).gyro_bias - state_at(8.05).gyro_bias).norm(), 0.0);
  EXPECT_GT((state_at(9.6).gyro_bias - state_at(8.05).gyro_bias).norm(), 0.0) << "one second later it learns again";
}

}  // namespace
}  // namespace ignis
