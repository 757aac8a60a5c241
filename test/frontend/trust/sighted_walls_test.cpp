// SPDX-License-Identifier: Apache-2.0
//
// A wall that each scan puts elsewhere, because the velocity is wrong, among points that belong to nothing.
#include "frontend/trust/sighted_walls.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "frontend/lio_runner.h"

namespace ignis {
namespace {

constexpr double kSigma = 0.3;        // m/s
constexpr double kAccelNoise = 0.06;  // m/s^2/sqrt(Hz)

struct Wall {
  double distance = 13.0;  ///< [m] ahead
  double width = 10.0;     ///< [m]
  double slope = 0.0;      ///< tangent of its angle to the way across
  int points = 14;         ///< of a scan
};

/// A second of scans, in which the pose runs away along -Z with `speed` beyond its true one.
SightedWalls seen(const Wall& wall, double speed, std::uint32_t seed, int stray_points = 25) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.02);
  SightedWalls walls;
  for (int scan = 0; scan < 20; ++scan) {
    const double run_away = -speed * 0.05 * scan;
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < wall.points; ++i) {
      const double x = wall.width * (unit(random) - 0.5);
      points.emplace_back(x, 2.4 * unit(random), -wall.distance + wall.slope * x + run_away + noise(random));
    }
    for (int i = 0; i < stray_points; ++i) {
      points.emplace_back(12.0 * unit(random) - 6.0, 3.0 * unit(random), -15.0 * unit(random) + run_away);
    }
    walls.add_scan(1'000'000 + 50'000 * scan, points);
  }
  return walls;
}

TEST(SightedWalls, TellHowMuchTooFastThePoseRuns) {
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    const double speed = std::uniform_real_distribution<double>(-0.9, 0.9)(random);
    const double slope = std::uniform_real_distribution<double>(-0.3, 0.3)(random);
    SightedWalls walls = seen({.slope = slope}, speed, seed);
    ASSERT_TRUE(walls.is_due());
    const std::optional<VelocityError> error = walls.judge(Eigen::Vector3d::UnitZ(), kSigma, kAccelNoise);
    ASSERT_TRUE(error) << "seed " << seed << ", " << speed << " m/s";
    // The pose runs along the axis; across a wall that is turned against it less of that shows.
    const double expected = Eigen::Vector3d(0.0, 0.0, -speed).dot(error->direction);
    EXPECT_NEAR(error->along, expected, 0.05) << "seed " << seed << ", slope " << slope;
    EXPECT_NEAR(error->direction.norm(), 1.0, 1e-12);
    EXPECT_NEAR(std::abs(error->direction.x() / error->direction.z()), std::abs(slope), 0.02) << "seed " << seed;
    EXPECT_FALSE(walls.is_due()) << "the same scans say nothing new";
  }
}

TEST(SightedWalls, AreNotMadeOfPointsThatBelongToNothing) {
  for (std::uint32_t seed = 1; seed <= 100; ++seed) {
    SightedWalls walls = seen({.points = 0}, 0.0, seed, 40);
    EXPECT_FALSE(walls.judge(Eigen::Vector3d::UnitZ(), kSigma, kAccelNoise)) << "seed " << seed;
  }
}

TEST(SightedWalls, AreNotTheEndOfWhatTheSensorReaches) {
  // Floor and walls thin out towards the range limit, which goes along with the vehicle and seems to stand before it.
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    SightedWalls walls;
    for (int scan = 0; scan < 20; ++scan) {
      std::vector<Eigen::Vector3d> points;
      for (int i = 0; i < 30; ++i) {
        const double range = 15.0 - 3.0 * unit(random);
        const double x = 6.0 * unit(random) - 3.0;
        points.emplace_back(x, 0.0, -std::sqrt(range * range - x * x) - 0.05 * scan);
      }
      walls.add_scan(1'000'000 + 50'000 * scan, points);
    }
    EXPECT_FALSE(walls.judge(Eigen::Vector3d::UnitZ(), 0.4, kAccelNoise)) << "seed " << seed;
  }
}

TEST(SightedWalls, AreNoRingOfFloorThatGoesWithTheVehicle) {
  // New floor always begins at one distance, which says that nothing moves.
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::normal_distribution<double> noise(0.0, 0.02);
    SightedWalls walls;
    for (int scan = 0; scan < 20; ++scan) {
      std::vector<Eigen::Vector3d> points;
      for (int i = 0; i < 12; ++i) points.emplace_back(8.0 * unit(random) - 4.0, noise(random), -14.0 + noise(random));
      for (int i = 0; i < 8; ++i) points.emplace_back(8.0 * unit(random) - 4.0, 2.8, -14.0 + noise(random));
      for (const double x : {-4.0, 4.0}) points.emplace_back(x, 2.8 * unit(random), -14.0 + noise(random));
      for (int i = 0; i < 10; ++i) points.emplace_back(8.0 * unit(random) - 4.0, 0.0, -15.0 * unit(random));
      walls.add_scan(1'000'000 + 50'000 * scan, points);
    }
    EXPECT_FALSE(walls.judge(Eigen::Vector3d::UnitZ(), 0.4, kAccelNoise)) << "seed " << seed;
  }
}

TEST(SightedWalls, AreWiderThanAMan) {
  EXPECT_TRUE(seen({.width = 2.0}, 0.5, 1).judge(Eigen::Vector3d::UnitZ(), kSigma, kAccelNoise));
  EXPECT_FALSE(seen({.width = 0.8}, 0.5, 1).judge(Eigen::Vector3d::UnitZ(), kSigma, kAccelNoise));
}

TEST(SightedWalls, DoNotMoveFasterThanTheVelocityMayBeOff) {
  EXPECT_TRUE(seen({}, 0.5, 1).judge(Eigen::Vector3d::UnitZ(), 0.15, kAccelNoise));
  EXPECT_FALSE(seen({}, 0.5, 1).judge(Eigen::Vector3d::UnitZ(), 0.13, kAccelNoise));
}

TEST(SightedWalls, SayNothingOfHeight) {
  EXPECT_FALSE(seen({}, 0.5, 1).judge(Eigen::Vector3d::UnitY(), kSigma, kAccelNoise));
}

TEST(SightedWalls, KnowTheVelocityNoBetterThanTheAccelerometerLeavesIt) {
  const double quiet = seen({}, 0.5, 1).judge(Eigen::Vector3d::UnitZ(), kSigma, 0.0)->variance;
  const double noisy = seen({}, 0.5, 1).judge(Eigen::Vector3d::UnitZ(), kSigma, 0.3)->variance;
  EXPECT_GE(quiet, 0.02 * 0.02);
  EXPECT_NEAR(noisy - quiet, 0.09 * 0.95 / 3.0, 1e-6) << "of a random walk over the 0.95 s, in the mean";
}

/// At rest for 2.5 s, then at 1 m/s after 0.8 s.
Pose set_off(double t) {
  const double driving = std::max(t - 2.5, 0.0);
  const double rise = std::min(driving, 0.8);
  return {Eigen::Quaterniond::Identity(), {0.0, 0.0, -1.25 * rise * (driving - 0.5 * rise)}};
}

/// How many keyframes of a drive at 1 m/s straight ahead tell a speed; what they tell is right.
int handed_on(const test::LioRun& run) {
  int count = 0;
  for (const ScanResult& scan : run.scans) {
    if (!scan.keyframe || !scan.keyframe->sighted) continue;
    ++count;
    const SightedSpeed& sighted = *scan.keyframe->sighted;
    EXPECT_NEAR(sighted.speed, -sighted.axis.z(), 4.0 * std::sqrt(sighted.variance));
  }
  return count;
}

/// Along a corridor that holds nothing the accelerometer loses half a metre a second, as noise may; then the end comes
/// into sight, 15 m ahead.
TEST(SightedWalls, GiveTheVelocityBackBehindABlindStretch) {
  test::World world = test::bare_corridor();
  world.room.lo = {-4.0, -0.6, -25.0};
  world.room.hi = {4.0, 2.8, world.room.hi.z()};
  test::Sensors sensors;
  sensors.range_sigma = 0.02;
  int led_astray = 0;
  int told = 0;
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    test::Drive drive = test::simulate(world, set_off, 16.0, sensors, seed);
    for (ImuSample& sample : drive.imu) {
      const double now = test::drive_seconds(drive, sample.utime);
      if (now > 5.0 && now < 9.0) sample.accel.z() += seed % 2 == 0 ? 0.12 : -0.12;
    }
    const test::LioRun run = test::run_lio(test::tuned_config(), drive);
    double blind = 0.0;
    double seeing = 0.0;
    for (const ScanResult& scan : run.scans) {
      const double now = test::drive_seconds(drive, scan.state.utime);
      const double error = std::abs(scan.state.v_odom.z() + 1.0);
      if (now > 9.0 && now < 12.0) blind = std::max(blind, error);
      if (now > 15.0) seeing = std::max(seeing, error);
    }
    // One of these starts passes for standing: that the velocity is off by all of it is not what is asked about here.
    if (blind < 0.2 || blind > 0.9) continue;
    ++led_astray;
    EXPECT_LT(seeing, 0.15) << "m/s, seed " << seed;
    told += handed_on(run);
  }
  EXPECT_GE(led_astray, 3) << "there was something to give back";
  EXPECT_GE(told, 2) << "to the graph, unless the drive ends before the next keyframe";
}

}  // namespace
}  // namespace ignis
