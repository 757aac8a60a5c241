// SPDX-License-Identifier: Apache-2.0
#include "frontend/keyframes/interval_information.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <span>

#include "common/frames.h"

namespace ignis {
namespace {

constexpr Utime kScanUs = 50'000;
constexpr int kSamplesPerScan = 10;
constexpr int kAlong = 5;  // body Z: the direction of travel

/// A vehicle that drives straight ahead, with a velocity that the filter knows to 0.05 m/s.
class Driver {
 public:
  explicit Driver(double yaw = 0.0) : interval(config) {
    filter.nominal.T_odom_body.rotation = frames::from_yaw_pitch_roll({yaw, 0.0, 0.0});
    filter.nominal.v_odom = filter.nominal.T_odom_body.rotation * Eigen::Vector3d(0.0, 0.0, -1.0);
    filter.covariance = 1e-8 * ErrorCovariance::Identity();
    filter.covariance.block<3, 3>(kVelocity, kVelocity) = 0.05 * 0.05 * Eigen::Matrix3d::Identity();
    interval.begin(filter);
  }

  /// Scans whose sigma along the way is `along_m`, and 1 mm and 1 mrad otherwise.
  void drive(int scans, double along_m) { drive(scans, 1.0 / (along_m * along_m), {}); }

  /// Scans that do not observe the way, with the information that they claim about it all the same.
  void drive_blindly(int scans, double information_along) {
    const std::array<Eigen::Vector3d, 1> axis{filter.nominal.T_odom_body.rotation * Eigen::Vector3d::UnitZ()};
    drive(scans, information_along, axis);
  }

  [[nodiscard]] double sigma_along() const { return 1.0 / std::sqrt(interval.information()(kAlong, kAlong)); }

  FrontendConfig config;
  FilterState filter;
  IntervalInformation interval;

 private:
  void drive(int scans, double information_along, std::span<const Eigen::Vector3d> blind) {
    for (int i = 0; i < scans; ++i) {
      for (int k = 0; k < kSamplesPerScan; ++k) {
        ImuSample sample;
        sample.accel = {0.0, config.gravity_m, 0.0};
        interval.add_imu(sample);
      }
      filter.nominal.utime += kScanUs;
      Matrix6d information = 1e6 * Matrix6d::Identity();
      information(kAlong, kAlong) = information_along;
      interval.add_scan(filter.nominal, information, blind);
    }
  }
};

TEST(IntervalInformation, IsZeroBeforeAnyScanAndWithoutApplicableOnes) {
  Driver driver;
  EXPECT_EQ(driver.interval.information().norm(), 0.0);
  driver.filter.nominal.utime += kScanUs;
  driver.interval.add_scan(driver.filter.nominal, Matrix6d::Zero(), {});
  EXPECT_EQ(driver.interval.information().norm(), 0.0);
}

TEST(IntervalInformation, SaysNothingWhereNoScanDoes) {
  Driver driver;
  driver.drive_blindly(40, 0.0);
  const Matrix6d information = driver.interval.information();
  // Dead reckoning along the way is known to a decimetre or so; of that nothing may be told as coming from scans.
  EXPECT_LT(information(kAlong, kAlong), 10.0);
  EXPECT_GT(information(3, 3), 1e5);
}

TEST(IntervalInformation, OneScanLeavesItsOwnInformation) {
  Driver driver;
  driver.drive(1, 0.002);
  EXPECT_NEAR(driver.sigma_along(), 0.002, 1e-5);
}

TEST(IntervalInformation, ManyPoorScansMakeAGoodOne) {
  Driver few;
  few.drive(10, 0.15);
  Driver many;
  many.drive(100, 0.15);
  EXPECT_LT(many.sigma_along(), 0.08);
  EXPECT_LT(many.sigma_along(), few.sigma_along());
}

TEST(IntervalInformation, WhatCameIntoViewIsKnownSinceThen) {
  Driver driver;
  driver.drive_blindly(20, 0.0);
  driver.drive(60, 0.002);
  // Velocity and the noise of the accelerometer made six centimetres in the second before.
  EXPECT_NEAR(driver.sigma_along(), 0.062, 0.002);
}

TEST(IntervalInformation, WhatBlindScansClaimHoldsTheMotionAndNotThePlace) {
  Driver seen;
  seen.drive(80, 0.002);
  Driver blind;
  blind.drive_blindly(80, 1.0 / (0.002 * 0.002));
  EXPECT_GT(blind.sigma_along(), 4.0 * seen.sigma_along());
  EXPECT_LT(blind.sigma_along(), 0.05) << "dead reckoning with this velocity knows a third of a metre";
}

TEST(IntervalInformation, WhatCameIntoViewAtTheEndSaysNothingOfTheInterval) {
  Driver driver;
  driver.drive_blindly(60, 0.0);
  driver.drive(1, 0.002);
  EXPECT_GT(driver.sigma_along(), 0.5);
}

TEST(IntervalInformation, WhatWasLostBeforeItBeganDoesNotCount) {
  Driver driver;
  driver.drive_blindly(60, 0.0);
  driver.drive(1, 0.002);
  driver.interval.begin(driver.filter);
  driver.drive_blindly(20, 0.0);
  driver.interval.begin(driver.filter);
  driver.drive(1, 0.002);
  EXPECT_NEAR(driver.sigma_along(), 0.002, 1e-4) << "at the very beginning of the interval nothing was lost yet";
}

TEST(IntervalInformation, WhatWasSeenAtTheStartAlonePassesAway) {
  Driver driver;
  driver.drive(10, 0.002);
  const double then = driver.sigma_along();
  driver.drive_blindly(60, 0.0);
  EXPECT_GT(driver.sigma_along(), 10.0 * then);
}

/// A velocity of zero, known to 0.02 m/s.
Standstill standing() {
  Standstill standstill;
  standstill.derivative.block<3, 3>(0, kVelocity).setIdentity();
  standstill.variance.setConstant(0.02 * 0.02);
  return standstill;
}

TEST(IntervalInformation, StandingHoldsTheWayThatScansLeaveOpen) {
  Driver silent;
  silent.drive_blindly(100, 0.0);
  Driver told;
  for (int i = 0; i < 20; ++i) {
    told.drive_blindly(5, 0.0);
    told.interval.add_standstill(standing());
  }
  EXPECT_GT(silent.sigma_along(), 0.5);
  EXPECT_LT(told.sigma_along(), 0.05) << "a quarter of a second after each";
}

TEST(IntervalInformation, StandingTellsTheWayWithoutAnyScan) {
  Driver driver;
  driver.interval.add_standstill(standing());
  driver.filter.nominal.utime += kScanUs;
  driver.interval.add_scan(driver.filter.nominal, Matrix6d::Zero(), {});
  EXPECT_GT(driver.interval.information()(kAlong, kAlong), 0.0);
}

TEST(IntervalInformation, IsToldInBodyAxesWhateverTheHeading) {
  Driver ahead;
  Driver turned(1.1);
  ahead.drive(30, 0.1);
  turned.drive(30, 0.1);
  EXPECT_TRUE(turned.interval.information().isApprox(ahead.interval.information(), 1e-6));
}

TEST(IntervalInformation, IsPositiveSemidefiniteAndBeginsAnew) {
  Driver driver;
  driver.drive(50, 0.05);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(driver.interval.information());
  EXPECT_GE(eigen.eigenvalues()(0), -1e-6 * eigen.eigenvalues()(5));
  driver.interval.begin(driver.filter);
  EXPECT_EQ(driver.interval.information().norm(), 0.0);
}

}  // namespace
}  // namespace ignis
