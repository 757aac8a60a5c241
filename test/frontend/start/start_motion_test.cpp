// SPDX-License-Identifier: Apache-2.0
#include "frontend/start/start_motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/so3.h"
#include "frontend/lio_runner.h"

namespace ignis {
namespace {

using test::Drive;
using test::Sensors;
using test::World;

std::optional<SteadyMotion> motion_in(const World& world, const test::Trajectory& truth, std::uint32_t seed) {
  StartMotion start_motion(test::tuned_config());
  for (const Scan& scan : test::simulate(world, truth, 1.5, Sensors{}, seed).scans) start_motion.add(scan);
  return start_motion.find();
}

test::Trajectory standing() {
  return [](double) { return Pose{}; };
}

/// A circle to the left, from the first instant on.
test::Trajectory arc(double speed, double turn) {
  return [=](double t) {
    const double radius = speed / turn;
    const Eigen::Vector3d at(radius * (std::cos(turn * t) - 1.0), 0.0, -radius * std::sin(turn * t));
    return Pose{so3::exp(Eigen::Vector3d(0.0, turn * t, 0.0)), at};
  };
}

TEST(StartMotion, FindsTheSpeedOfAVehicleThatNeverStood) {
  for (const double speed : {-0.7, 0.2, 0.3, 0.7, 1.5, 3.0}) {
    const std::optional<SteadyMotion> motion = motion_in(test::furnished_hall(), test::straight_drive(0.0, speed), 3);
    ASSERT_TRUE(motion) << speed;
    EXPECT_TRUE(motion->is_rolling()) << speed;
    const Eigen::Vector3d error = motion->twist.tail<3>() - Eigen::Vector3d(0.0, 0.0, -speed);
    const Eigen::Vector3d sigma = motion->covariance.diagonal().tail<3>().cwiseSqrt();
    EXPECT_LT(error.norm(), 0.05) << speed;
    EXPECT_LT((error.array() / sigma.array()).abs().maxCoeff(), 3.0) << speed;
  }
}

TEST(StartMotion, FindsTheTurnThatTheGyrosBiasHides) {
  const std::optional<SteadyMotion> motion = motion_in(test::furnished_hall(), arc(1.0, 0.04), 4);
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->twist[1], 0.04, 0.006);
  EXPECT_NEAR(motion->twist[5], -1.0, 0.05);
}

TEST(StartMotion, SeesThatAVehicleStands) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    const std::optional<SteadyMotion> motion = motion_in(test::furnished_hall(), standing(), seed);
    ASSERT_TRUE(motion) << seed;
    EXPECT_FALSE(motion->is_rolling()) << describe(*motion);
  }
}

TEST(StartMotion, SeesThatAVehicleStandsThoughPointsHaveNoTimes) {
  StartMotion start_motion(test::tuned_config());
  for (Scan scan : test::simulate(test::furnished_hall(), standing(), 1.5, Sensors{}, 1).scans) {
    scan.utime = scan.end_utime();
    scan.duration_us = 0;
    for (ScanPoint& point : scan.points) point.dt_us = 0;
    start_motion.add(scan);
  }
  const std::optional<SteadyMotion> motion = start_motion.find();
  ASSERT_TRUE(motion);
  EXPECT_FALSE(motion->is_rolling()) << describe(*motion);
}

TEST(StartMotion, SaysNothingWhereAllPlacesAlongTheWayLookAlike) {
  EXPECT_FALSE(motion_in(test::bare_corridor(), standing(), 5));
  EXPECT_FALSE(motion_in(test::bare_corridor(), test::straight_drive(0.0, 1.5), 5));
}

TEST(StartMotion, SaysNothingWithoutScans) {
  StartMotion start_motion(test::tuned_config());
  EXPECT_FALSE(start_motion.find());
  Scan empty;
  for (int i = 0; i < 20; ++i) {
    empty.utime += 50'000;
    empty.duration_us = 50'000;
    start_motion.add(empty);
  }
  EXPECT_FALSE(start_motion.find());
}

TEST(StartMotion, ARollingStartKeepsWhatTheGyroReadAsTurnAndBias) {
  FilterState first;
  first.nominal.gyro_bias = Eigen::Vector3d(0.01, 0.045, 0.0);
  SteadyMotion motion;
  motion.twist << 0.0, 0.04, 0.0, 0.0, 0.0, -2.0;
  motion.covariance = 0.01 * Matrix6d::Identity();
  const ErrorCovariance before = first.covariance;
  set_rolling(first, motion, 9.81);
  EXPECT_NEAR(first.nominal.gyro_bias.y(), 0.005, 1e-12);
  EXPECT_NEAR(first.nominal.angular_rate.y(), 0.04, 1e-12);
  EXPECT_NEAR(first.nominal.v_odom.z(), -2.0, 1e-12);
  EXPECT_NEAR(first.covariance(kVelocity, kVelocity), 0.01, 1e-12);
  EXPECT_GT(first.covariance(kGyroBias, kGyroBias), before(kGyroBias, kGyroBias));
  EXPECT_GT(first.covariance(kGravityTilt, kGravityTilt), before(kGravityTilt, kGravityTilt));
}

TEST(Fault_F5, AStartInMotionGoesOnAtTheTrueSpeed) {
  for (const double speed : {0.3, 0.7, 1.5, 3.0}) {
    const Drive cruise = test::simulate(test::street(), test::straight_drive(0.0, speed), 6.0, Sensors{}, 6);
    const double worst = test::worst_silent_error(run_lio(test::tuned_config(), cruise), cruise);
    EXPECT_LT(worst, 0.2) << speed;
    EXPECT_GE(worst, 0.0) << speed << ": it becomes OK";
  }
}

TEST(Fault_F5, AStartThatNobodyCanTellFromMotionSaysSoAndIsNotOkAtOnce) {
  const Drive cruise = test::simulate(test::bare_corridor(), test::straight_drive(0.0, 1.5), 3.4, Sensors{}, 7);
  const test::LioRun run = test::run_lio(test::tuned_config(), cruise);
  EXPECT_NE(run.status.text.find("scans do not tell whether it stood"), std::string::npos) << run.status.text;
  EXPECT_EQ(run.status.trust, Trust::kDegraded) << run.status.reason;
}

}  // namespace
}  // namespace ignis
