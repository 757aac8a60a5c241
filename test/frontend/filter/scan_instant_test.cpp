// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/scan_instant.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "frontend/matching/deskew.h"

namespace ignis {
namespace {

Scan scan_of(std::initializer_list<std::int32_t> times) {
  Scan scan;
  scan.utime = 1'000'000;
  scan.duration_us = 50'000;
  for (const std::int32_t dt : times) scan.points.push_back({.position = {1.0F, 2.0F, -3.0F}, .dt_us = dt});
  return scan;
}

TEST(ScanInstant, MeanAgeIsFromThePointsToTheEndOfTheScan) {
  EXPECT_DOUBLE_EQ(mean_age(scan_of({0, 50'000})), 0.025);
  EXPECT_DOUBLE_EQ(mean_age(scan_of({50'000})), 0.0);
  EXPECT_DOUBLE_EQ(mean_age(scan_of({0, 0, 30'000})), 0.04);
  EXPECT_DOUBLE_EQ(mean_age(Scan{}), 0.0);
  EXPECT_DOUBLE_EQ(mean_age(scan_of({-2'000'000'000, 2'000'000'000})), 0.025) << "as the points are deskewed";
}

TEST(ScanInstant, CovarianceIsThatOfThePositionPlusSecondsTimesVelocity) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const ErrorCovariance root = ErrorCovariance::NullaryExpr([&] { return normal(random); });
  const ErrorCovariance P = root * root.transpose();
  ErrorCovariance J = ErrorCovariance::Identity();
  J.block<3, 3>(kPosition, kVelocity) = -0.03 * Eigen::Matrix3d::Identity();
  EXPECT_LT((with_position_at(P, -0.03) - J * P * J.transpose()).norm(), 1e-12 * P.norm());
  EXPECT_LT((with_position_at(with_position_at(P, -0.03), 0.03) - P).norm(), 1e-12 * P.norm());
}

TEST(ScanInstant, TheGyrosNoiseTurnsTheMeanOfADeskewedScanByWhatIsTold) {
  constexpr double kNoise = 0.003;  // rad/s/sqrt(Hz)
  constexpr Utime kPeriodUs = 1'000;
  Scan scan;
  scan.utime = 1'000'000;
  scan.duration_us = 100'000;
  for (std::int32_t dt = 0; dt <= scan.duration_us; dt += 500) {
    scan.points.push_back({.position = {0.0F, 0.0F, -10.0F}, .dt_us = dt});
  }
  NavState end;
  end.utime = scan.end_utime();
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, kNoise / std::sqrt(1e-6 * kPeriodUs));
  double variance = 0.0;
  constexpr int kTrials = 1000;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<ImuSample> imu(102);
    for (std::size_t i = 0; i < imu.size(); ++i) {
      imu[i].utime = scan.utime + kPeriodUs * static_cast<Utime>(i);
      imu[i].accel = {0.0, 9.81, 0.0};
      imu[i].gyro.y() = noise(random);
    }
    double turn = 0.0;
    for (const CloudPoint& point : deskew(scan, end, imu, 9.81)) turn += point.position.x() / 10.0;
    turn /= static_cast<double>(scan.points.size());
    variance += turn * turn / kTrials;
  }
  EXPECT_NEAR(variance / unseen_turn_variance(kNoise, 0.1), 1.0, 0.15);  // three sigma of so many trials
}

TEST(ScanInstant, OnlyWhatIsNewOfTheVelocitysErrorCounts) {
  ErrorCovariance P = ErrorCovariance::Identity();
  EXPECT_DOUBLE_EQ(velocity_variance(P), 3.0);
  EXPECT_DOUBLE_EQ(new_share(P, 3.0), 0.0) << "the map was shifted by the same error";
  EXPECT_DOUBLE_EQ(new_share(P, 4.0), 0.0);
  EXPECT_DOUBLE_EQ(new_share(P, 0.75), 0.75);
  EXPECT_DOUBLE_EQ(new_share(P, 0.0), 1.0);
}

TEST(ScanInstant, DeskewingWithAWrongVelocityShiftsTheScanByTheMeanAge) {
  // The oracle: the same points, deskewed with the velocity and with one that is off.
  const Scan scan = scan_of({0, 10'000, 20'000, 35'000});
  std::vector<ImuSample> imu(14);
  for (std::size_t i = 0; i < imu.size(); ++i) {
    imu[i].utime = scan.utime + 4'000 * static_cast<Utime>(i);
    imu[i].accel = {0.0, 9.81, 0.0};
  }
  NavState state;
  state.utime = scan.end_utime();
  state.v_odom = {0.5, 0.0, -1.0};
  NavState wrong = state;
  const Eigen::Vector3d error(0.4, -0.2, 1.0);
  wrong.v_odom += error;
  const std::vector<CloudPoint> right_cloud = deskew(scan, state, imu, 9.81);
  const std::vector<CloudPoint> wrong_cloud = deskew(scan, wrong, imu, 9.81);
  Eigen::Vector3f shift = Eigen::Vector3f::Zero();
  for (std::size_t i = 0; i < right_cloud.size(); ++i) shift += wrong_cloud[i].position - right_cloud[i].position;
  shift /= static_cast<float>(right_cloud.size());
  EXPECT_LT((shift.cast<double>() + mean_age(scan) * error).norm(), 1e-6);
}

}  // namespace
}  // namespace ignis
