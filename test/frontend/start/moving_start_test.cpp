// SPDX-License-Identifier: Apache-2.0
//
// `frontend.start` "moving": a vehicle that turns and brakes when the first data come.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/frames.h"
#include "common/so3.h"
#include "frontend/lio_runner.h"
#include "frontend/start/imu_initialisation.h"
#include "frontend/start/start_motion.h"

namespace ignis {
namespace {

using test::Drive;
using test::LioRun;
using test::Sensors;

constexpr double kSpeed = 1.6;
constexpr double kBraking = -0.4;

/// A curve to the left of 3 m radius, braking until it creeps.
Pose braking_curve(double t) {
  const double radius = 3.0;
  const double braked = std::min(t, 3.5);
  const double way = kSpeed * braked + 0.5 * kBraking * braked * braked + (t - braked) * (kSpeed + kBraking * braked);
  const double turn = way / radius;
  return {so3::exp(Eigen::Vector3d(0.0, turn, 0.0)),
          Eigen::Vector3d(radius * (std::cos(turn) - 1.0), 0.0, -radius * std::sin(turn))};
}

/// Everything is seen in every scan.
test::World small_room() {
  return {.room = {.lo = {-2.0, -0.5, -3.0}, .hi = {2.5, 2.2, 2.0}},
          .boxes = {{.lo = {1.0, -0.5, -2.0}, .hi = {1.8, 0.6, -1.0}}},
          .pillars = {}};
}

FrontendConfig moving_config() {
  FrontendConfig config = test::tuned_config();
  config.start = "moving";
  return config;
}

/// Both streams in order; `after` is called behind each inertial sample.
void feed(Lio& lio, const Drive& drive, const std::function<void(double)>& after = [](double) {}) {
  auto scan = drive.scans.begin();
  for (const ImuSample& sample : drive.imu) {
    for (; scan != drive.scans.end() && scan->end_utime() + 2'000 <= sample.utime; ++scan) (void)lio.add_scan(*scan);
    (void)lio.add_imu(sample);
    after(test::drive_seconds(drive, sample.utime));
  }
}

TEST(MovingStart, AnL1ThatTurnsAndBrakesGoesOnAtTheTrueSpeed) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    const Drive drive = test::simulate(test::furnished_hall(), braking_curve, 8.0, Sensors{}, seed);
    const LioRun run = run_lio(moving_config(), drive);
    ASSERT_TRUE(run.status.running) << run.status.text;
    const auto first = std::ranges::find_if(run.scans, [](const ScanResult& scan) { return scan.has_state; });
    const double t = test::drive_seconds(drive, first->state.utime);
    ASSERT_LT(t, 3.0);
    EXPECT_NEAR(first->state.v_odom.norm(), kSpeed + kBraking * t, 0.15);
    EXPECT_LT(test::aligned_error(run, drive), 0.02);
    EXPECT_LT(test::worst_silent_error(run, drive), 0.3);
  }
}

TEST(MovingStart, TheMapIsLevelThoughTheAccelerationLooksLikeATilt) {
  const Drive drive = test::simulate(test::furnished_hall(), braking_curve, 2.5, Sensors{}, 4);
  const LioRun run = run_lio(moving_config(), drive);
  ASSERT_TRUE(run.status.running) << run.status.text;
  const ScanResult& last = run.scans.back();
  const Eigen::Vector3d up = last.state.T_odom_body.rotation.conjugate() * frames::up();
  const double tilt = std::acos(std::clamp(up.dot(frames::up()), -1.0, 1.0));
  // Braking at 0.4 and turning at 0.3 to 0.9 m/s^2 make 0.05 to 0.1 rad of it.
  EXPECT_LT(tilt, 0.03);
}

TEST(MovingStart, WaitsAndSaysWhyWhereScansDoNotTellTheSpeed) {
  const Drive drive = test::simulate(test::bare_corridor(), test::straight_drive(0.0, 1.5), 4.0, Sensors{}, 5);
  const LioRun run = run_lio(moving_config(), drive);
  EXPECT_FALSE(run.status.running);
  EXPECT_EQ(run.status.text, "start refused, waiting: scans do not tell how fast it goes");
  EXPECT_EQ(test::count(run, ScanReason::kNotInitialised), static_cast<int>(run.scans.size()));
}

TEST(MovingStart, WaitsForALiDARThatHasToSpinUp) {
  Drive drive = test::simulate(test::furnished_hall(), braking_curve, 8.0, Sensors{}, 8);
  std::erase_if(drive.scans, [&](const Scan& scan) { return scan.utime < drive.imu.front().utime + to_micros(3.0); });
  Lio early(moving_config());
  for (const ImuSample& sample : drive.imu) {
    if (test::drive_seconds(drive, sample.utime) < 2.5) (void)early.add_imu(sample);
  }
  EXPECT_EQ(early.status().text, "waiting for a second of scans");
  const LioRun run = run_lio(moving_config(), drive);
  ASSERT_TRUE(run.status.running) << run.status.text;
  EXPECT_EQ(run.status.text.find("started moving: scans say that it moves: forward at "), 0U) << run.status.text;
  const auto first = std::ranges::find_if(run.scans, [](const ScanResult& scan) { return scan.has_state; });
  EXPECT_LT(test::drive_seconds(drive, first->state.utime), 4.0) << "it asks as soon as there is a second of them";
  EXPECT_LT(test::aligned_error(run, drive), 0.02);
}

TEST(MovingStart, DoesNotBeginWhereScansEndedLongAgo) {
  Drive drive = test::simulate(test::furnished_hall(), braking_curve, 5.0, Sensors{}, 9);
  const auto is_missing = [&](const Scan& scan) {
    const double t = test::drive_seconds(drive, scan.utime);
    return t > 1.2 && t < 2.2;
  };
  std::erase_if(drive.scans, is_missing);
  Lio lio(moving_config());
  feed(lio, drive, [&](double t) {
    if (t > 1.6 && t < 2.1) {
      ASSERT_EQ(lio.status().text, "waiting for a second of scans") << t;
    }
  });
  EXPECT_TRUE(lio.status().running) << lio.status().text;
}

TEST(MovingStart, AResetForgetsWhatScansDidNotTell) {
  const Drive drive = test::simulate(test::bare_corridor(), test::straight_drive(0.0, 1.5), 2.0, Sensors{}, 5);
  Lio lio(moving_config());
  feed(lio, drive);
  ASSERT_EQ(lio.status().text, "start refused, waiting: scans do not tell how fast it goes");
  lio.reset();
  EXPECT_EQ(lio.status().text, "waiting for 1.5 s of IMU data");
}

TEST(MovingStart, WithoutScanMatchingTheImuAloneBegins) {
  FrontendConfig config = moving_config();
  config.use_scan_matching = false;
  const Drive drive = test::simulate(test::furnished_hall(), braking_curve, 2.5, Sensors{}, 4);
  EXPECT_TRUE(run_lio(config, drive).status.running);
}

TEST(MovingStart, AVehicleThatStandsBeginsAsOneThatStands) {
  const Drive drive = test::simulate(small_room(), [](double) { return Pose{}; }, 4.0, Sensors{}, 6);
  const LioRun run = run_lio(moving_config(), drive);
  ASSERT_TRUE(run.status.running) << run.status.text;
  const auto first = std::ranges::find_if(run.scans, [](const ScanResult& scan) { return scan.has_state; });
  EXPECT_LT(first->state.v_odom.norm(), 0.1);
  EXPECT_LT(test::aligned_error(run, drive), 0.02);
}

/// Between two scans the car goes farther than the matcher sees.
TEST(MovingStart, DenseScansAreSearchedForWidelyUntilTheSpeedIsKnown) {
  Sensors sensors;
  sensors.car = true;
  sensors.scan_hz = 10.0;
  sensors.max_range = 80.0;
  FrontendConfig config = moving_config();
  config.start_seconds = 0.2;
  config.max_range_m = 80.0;
  config.voxel_size_m = 0.2;
  config.match_radius_m = 0.3;
  config.wide_match_radius_m = 0.6;
  config.max_mean_innovation = 0.3;
  config.max_scan_correction_m = 3.0;
  config.max_scan_velocity_corr = 3.0;
  config.map_window_m = 100.0;
  const Drive drive = test::simulate(test::street(), test::straight_drive(0.0, 12.0), 3.0, sensors, 7);
  const LioRun run = run_lio(config, drive);
  EXPECT_LT((run.scans.back().state.v_odom - Eigen::Vector3d(0.0, 0.0, -12.0)).norm(), 0.3);
  EXPECT_LT(test::aligned_error(run, drive), 0.1);
}

TEST(MovingStart, TheFirstStateIsLevelByTheAccelerationThatScansFound) {
  const FrontendConfig config = moving_config();
  // It brakes at 0.5 m/s^2, and the specific force (0, g, 0.5) was taken for "up".
  NavState standing;
  standing.T_odom_body.rotation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(0.0, 9.81, 0.5), frames::up());
  standing.angular_rate = Eigen::Vector3d(0.0, 0.3, 0.0);
  BentMotion motion;
  motion.steady.twist << 0.0, -0.01, 0.0, 0.0, 0.0, -2.0;
  motion.steady.covariance = 0.01 * Matrix6d::Identity();
  motion.acceleration = Eigen::Vector3d(0.0, 0.0, 0.5);
  motion.acceleration_sigma = 0.1;
  const FilterState first = moving_state(config, standing, motion);
  EXPECT_LT(first.nominal.T_odom_body.rotation.angularDistance(Eigen::Quaterniond::Identity()), 2e-3);
  EXPECT_LT((first.nominal.v_odom - Eigen::Vector3d(0.0, 0.0, -2.0)).norm(), 0.01);
  EXPECT_NEAR(first.nominal.gyro_bias.y(), 0.01, 1e-12);
  EXPECT_NEAR(first.nominal.angular_rate.y(), 0.29, 1e-12);
  EXPECT_NEAR(first.covariance(kVelocity, kVelocity), 0.01, 1e-6);
  const double tilt = std::hypot(motion.acceleration_sigma, config.accel_bias_sigma) / config.gravity_m;
  EXPECT_NEAR(std::sqrt(first.covariance(kGravityTilt, kGravityTilt)), tilt, 0.1 * tilt);
}

TEST(MovingStart, TheFirstStateIsLevelByWhatTheAccelerometerReadAndNotLessAnEarlierBias) {
  const FrontendConfig config = moving_config();
  NavState standing;  // level with that bias, which is not told apart from a tilt here
  standing.accel_bias = Eigen::Vector3d(0.0, 0.0, 0.3);
  const FilterState first = moving_state(config, standing, BentMotion{});
  const Eigen::Vector3d read = config.gravity_m * frames::up() + standing.accel_bias;
  EXPECT_LT((first.nominal.T_odom_body.rotation * read.normalized() - frames::up()).norm(), 1e-9);
}

TEST(MovingStart, AStateFromAForceThatIsKnownIsAsLevelAsTheForceIsSure) {
  const FrontendConfig config = moving_config();
  const Eigen::Vector3d up_force = 9.81 * Eigen::Vector3d(0.05, 1.0, -0.08).normalized();
  const FilterState sure = moving_state(config, up_force, 1e-4);
  const FilterState vague = moving_state(config, up_force, 1.0);
  EXPECT_LT((sure.nominal.T_odom_body.rotation * up_force - 9.81 * frames::up()).norm(), 1e-9);
  const double bias_alone = config.accel_bias_sigma / config.gravity_m;
  EXPECT_NEAR(std::sqrt(sure.covariance(kGravityTilt, kGravityTilt)), bias_alone, 0.1 * bias_alone);
  EXPECT_GT(std::sqrt(vague.covariance(kGravityTilt, kGravityTilt)), 0.09);
}

}  // namespace
}  // namespace ignis
