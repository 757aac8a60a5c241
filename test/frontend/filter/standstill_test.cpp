// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/standstill.h"

#include <gtest/gtest.h>

#include <random>

#include "frontend/lio_runner.h"
#include "frontend/matching/scan_update.h"

namespace ignis {
namespace {

bool stands_still(std::span<const ImuSample> samples, const FilterState& filter, const FrontendConfig& config) {
  return find_standstill(samples, filter, config).has_value();
}

/// One second of a quiet IMU at 250 Hz, ending at utime 1,000,000.
std::vector<ImuSample> quiet_samples(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<ImuSample> samples;
  for (int i = 1; i <= 250; ++i) {
    ImuSample sample;
    sample.utime = 4000 * i;
    for (int axis = 0; axis < 3; ++axis) {
      sample.gyro[axis] = 0.003 * std::sqrt(250.0) * normal(random);
      sample.accel[axis] = 0.06 * std::sqrt(250.0) * normal(random);
    }
    sample.accel.y() += 9.81;
    samples.push_back(sample);
  }
  return samples;
}

FilterState resting_state() {
  FilterState filter;
  filter.nominal.utime = 1'000'000;
  filter.covariance.diagonal() << Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Constant(1e-4),
      Eigen::Vector3d::Constant(4e-4), Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-3),
      Eigen::Vector2d::Constant(1e-4);
  return filter;
}

TEST(Standstill, IsSeenInAQuietHalfSecond) {
  int seen = 0;
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    seen += stands_still(quiet_samples(seed), resting_state(), FrontendConfig{}) ? 1 : 0;
  }
  EXPECT_GE(seen, 90) << "two gates at three sigma of three axes refuse 2.9 % each";
}

TEST(Standstill, IsNotTakenForASteadyDriveWhoseImuIsAsQuiet) {
  FilterState filter = resting_state();
  filter.nominal.v_odom = {0.0, 0.0, -0.5};
  EXPECT_FALSE(stands_still(quiet_samples(1), filter, FrontendConfig{}));
  filter.nominal.v_odom.setZero();
  filter.covariance.diagonal().segment<3>(kVelocity).setConstant(0.25);
  EXPECT_FALSE(stands_still(quiet_samples(1), filter, FrontendConfig{})) << "a velocity nobody knows is not zero";
}

int seen_in_a_hundred(const FilterState& filter, Unless unless) {
  int seen = 0;
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    seen += find_standstill(quiet_samples(seed), filter, FrontendConfig{}, unless) ? 1 : 0;
  }
  return seen;
}

TEST(Standstill, OfAVehicleThatStoodIsSeenThoughTheVelocityIsOffByNearlyThreeSigma) {
  FilterState filter = resting_state();
  filter.covariance.diagonal().segment<3>(kVelocity).setConstant(0.06 * 0.06);
  filter.nominal.v_odom = {0.22, 0.0, 0.0};
  EXPECT_FALSE(must_move(filter, FrontendConfig{}));
  EXPECT_GE(seen_in_a_hundred(filter, Unless::kItMustRoll), 85);
  filter.nominal.v_odom = {0.24, 0.0, 0.0};
  EXPECT_TRUE(must_move(filter, FrontendConfig{}));
  EXPECT_EQ(seen_in_a_hundred(filter, Unless::kItMustRoll), 0);
}

TEST(Standstill, OfAVehicleThatDroveIsSeenWhereTwoSigmaMoreWouldBeHardlyAMotion) {
  FilterState filter = resting_state();
  filter.covariance.diagonal().segment<3>(kVelocity).setConstant(0.06 * 0.06);
  filter.nominal.v_odom = {0.07, 0.0, 0.0};
  EXPECT_GE(seen_in_a_hundred(filter, Unless::kItMayRoll), 85);
  filter.nominal.v_odom = {0.09, 0.0, 0.0};
  EXPECT_EQ(seen_in_a_hundred(filter, Unless::kItMayRoll), 0) << "it may go on at 0.2 m/s";
}

TEST(Standstill, IsRefusedByTurnByAccelerationByVibrationAndByClipping) {
  const FrontendConfig config;
  const auto refused = [&](auto change) {
    std::vector<ImuSample> samples = quiet_samples(1);
    for (std::size_t i = 0; i < samples.size(); ++i) change(samples[i], i);
    return !stands_still(samples, resting_state(), config);
  };
  EXPECT_FALSE(refused([](ImuSample&, std::size_t) {}));
  EXPECT_TRUE(refused([](ImuSample& s, std::size_t) { s.gyro.y() += 0.05; }));
  EXPECT_TRUE(refused([](ImuSample& s, std::size_t i) { s.accel.z() += i > 187 ? 1.0 : 0.0; })) << "setting off";
  EXPECT_TRUE(refused([](ImuSample& s, std::size_t i) { s.accel.x() += i % 2 == 0 ? 4.0 : -4.0; }));
  EXPECT_TRUE(refused([](ImuSample& s, std::size_t i) { s.gyro.z() += i % 2 == 0 ? 0.4 : -0.4; }));
  EXPECT_TRUE(refused([](ImuSample& s, std::size_t i) { s.saturated = i == 200; }));
  EXPECT_TRUE(refused([](ImuSample& s, std::size_t) { s.accel.y() += 0.7; })) << "not the size of gravity";
  const std::vector<ImuSample> samples = quiet_samples(1);
  EXPECT_FALSE(stands_still(std::span(samples).last(100), resting_state(), config)) << "no half second of it";
}

FilterState correlated_state() {
  FilterState filter = resting_state();
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  ErrorCovariance root;
  for (double& value : root.reshaped()) value = 0.01 * normal(random);
  filter.covariance += root * root.transpose();
  filter.nominal.v_odom = {0.03, -0.02, 0.01};
  filter.nominal.accel_bias = {0.02, 0.01, -0.03};
  return filter;
}

TEST(Standstill, DerivativeOfTheEarlierVelocityIsTheNumericalOne) {
  const std::vector<ImuSample> samples = quiet_samples(4);
  const FilterState filter = correlated_state();
  const auto at = find_standstill(samples, filter, FrontendConfig{});
  ASSERT_TRUE(at);
  for (int i = 0; i < kErrorSize; ++i) {
    constexpr double kStep = 1e-6;
    FilterState moved = filter;
    moved.nominal = perturbed(filter.nominal, kStep * ErrorVector::Unit(i));
    const auto there = find_standstill(samples, moved, FrontendConfig{});
    ASSERT_TRUE(there);
    EXPECT_LT(((there->estimate - at->estimate) / kStep - at->derivative.col(i)).norm(), 1e-4) << i;
  }
}

TEST(Standstill, CorrectionEqualsAKalmanUpdateWrittenOut) {
  FilterState filter = correlated_state();
  const ErrorCovariance P = filter.covariance;
  const auto standstill = find_standstill(quiet_samples(4), filter, FrontendConfig{});
  ASSERT_TRUE(standstill);

  // Independent form: information matrices added.
  const auto& H = standstill->derivative;
  const Matrix6d W = standstill->variance.cwiseInverse().asDiagonal();
  const ErrorCovariance expected = (P.inverse() + H.transpose() * W * H).inverse();
  const ErrorVector step = -expected * H.transpose() * W * standstill->estimate;
  const NavState moved = perturbed(filter.nominal, step);

  correct_to_standstill(filter, *standstill);
  EXPECT_LT((filter.covariance - expected).norm(), 1e-9 * P.norm());
  EXPECT_LT(difference(moved, filter.nominal).norm(), 1e-12);
}

TEST(Standstill, TeachesTheGyroBias) {
  std::vector<ImuSample> samples = quiet_samples(1);
  for (ImuSample& sample : samples) sample.gyro = {0.002, -0.001, 0.0015};
  FilterState filter = resting_state();
  const auto standstill = find_standstill(samples, filter, FrontendConfig{});
  ASSERT_TRUE(standstill);
  for (int i = 0; i < 400; ++i) {
    const auto again = find_standstill(samples, filter, FrontendConfig{});
    ASSERT_TRUE(again);
    correct_to_standstill(filter, *again);
  }
  EXPECT_LT((filter.nominal.gyro_bias - samples[0].gyro).norm(), 3e-4);
}

TEST(Standstill, DoesNotHoldBackAVehicleThatSetsOff) {
  // 0.8 m/s^2 for the last fifth of a second: velocity 0.16, and no sign of it yet in the means.
  std::vector<ImuSample> samples = quiet_samples(1);
  for (ImuSample& sample : samples) sample.accel = {0.0, 9.81, sample.utime > 800'000 ? -0.8 : 0.0};
  FilterState filter = resting_state();
  filter.nominal.v_odom = {0.0, 0.0, -0.14};
  filter.covariance.diagonal().segment<3>(kVelocity).setConstant(0.05 * 0.05);
  if (const auto standstill = find_standstill(samples, filter, FrontendConfig{})) {
    correct_to_standstill(filter, *standstill);
  }
  EXPECT_NEAR(filter.nominal.v_odom.z(), -0.15, 0.02);
}

TEST(Standstill, KeepsAStandingVehicleInPlaceWithoutScans) {
  const test::Drive standing = test::simulate(test::furnished_hall(), test::straight_drive(60.0, 0.0), 20.0, {}, 5);
  test::Drive blind = standing;
  // Scans far too small to be matched still tell the time.
  for (Scan& scan : blind.scans) {
    if (scan.utime > blind.imu.front().utime + 5'000'000) scan.points.resize(10);
  }
  FrontendConfig config = test::tuned_config();
  const test::LioRun with = test::run_lio(config, blind);
  EXPECT_TRUE(with.scans.back().stats.standing);
  EXPECT_LT(test::end_error(with, blind), 0.05);
  config.zero_velocity_sigma = 0.0;
  const test::LioRun without = test::run_lio(config, blind);
  EXPECT_FALSE(without.scans.back().stats.standing);
  EXPECT_GT(test::end_error(without, blind), 5.0 * test::end_error(with, blind));
}

// Where scans do not see the motion. A start to 0.4 m/s is so gentle that some seeds take it for a bias.
TEST(Standstill, IsNeverSeenWhileTheVehicleDrives) {
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const test::Drive drive = test::simulate(test::bare_corridor(), test::straight_drive(3.0, 0.6), 15.0, {}, seed);
    const test::LioRun run = test::run_lio(test::tuned_config(), drive);
    int standing = 0;
    int wrong = 0;
    for (const ScanResult& scan : run.scans) {
      standing += scan.stats.standing ? 1 : 0;
      wrong += scan.stats.standing && test::drive_seconds(drive, scan.stats.utime) > 5.0 ? 1 : 0;
    }
    EXPECT_GT(standing, 10) << "it stood at first";
    EXPECT_EQ(wrong, 0) << "seed " << seed;
  }
}

}  // namespace
}  // namespace ignis
