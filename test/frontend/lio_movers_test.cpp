// SPDX-License-Identifier: Apache-2.0
//
// Traffic in an aisle. The walls say nothing about the way along it, the end does a little, and what goes by says much
// that is not so.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "frontend/lio_runner.h"

namespace ignis {
namespace {

constexpr double kRest = 2.5;   // s
constexpr double kSpeed = 1.0;  // m/s, of the vehicle

/// Ahead is -Z; both ends are out of range. What faces along the way are cupboards on the left.
test::World aisle() {
  test::World world;
  world.room = {{-3.0, -0.6, -60.0}, {3.0, 3.4, 60.0}};
  for (int i = -3; i < 8; ++i) world.boxes.push_back({{-3.0, -0.6, -4.0 * i - 1.5}, {-2.6, 1.4, -4.0 * i}});
  return world;
}

/// A forklift with its load, in the middle of which is (x, z) until it sets off.
test::Mover forklift(double x, double z, double velocity_z, double start_s) {
  return {{{x - 0.6, -0.6, z - 1.0}, {x + 0.6, 1.6, z + 1.0}}, {0.0, 0.0, velocity_z}, start_s};
}

struct Along {
  double speed_error = 0.0;       ///< [m/s] largest
  double error = 0.0;             ///< [m] at the end
  double normalised_error = 0.0;  ///< the same in sigma
};

Along along_aisle(const test::World& world, std::uint32_t seed) {
  test::Sensors sensors;
  sensors.range_sigma = 0.02;
  const test::Drive drive = test::simulate(world, test::straight_drive(kRest, kSpeed), 11.0, sensors, seed);
  const test::LioRun run = test::run_lio(test::tuned_config(), drive);
  Along along;
  for (const ScanResult& scan : run.scans) {
    if (!scan.has_state) continue;
    const double now = test::drive_seconds(drive, scan.state.utime);
    if (now < kRest + 2.5) continue;  // up to speed
    along.speed_error = std::max(along.speed_error, std::abs(scan.state.v_odom.z() + kSpeed));
    along.error = std::abs(scan.state.T_odom_body.translation.z() - drive.truth(now).translation.z());
    along.normalised_error = along.error / std::sqrt(scan.covariance(kPosition + 2, kPosition + 2));
  }
  return along;
}

TEST(LioMovers, AnAisleWithoutTrafficIsHeld) {
  const Along along = along_aisle(aisle(), 1);
  EXPECT_LT(along.speed_error, 0.25);
  EXPECT_LT(along.normalised_error, 3.0);
}

TEST(LioMovers, AForkliftThatComesTheOtherWayDoesNotTakeTheVehicleWithIt) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    test::World world = aisle();
    world.movers = {forklift(1.9, -11.0, 1.5, 4.0)};
    const Along along = along_aisle(world, seed);
    EXPECT_LT(along.speed_error, 0.4) << "seed " << seed;
    EXPECT_LT(along.normalised_error, 3.0) << "seed " << seed << ": " << along.error << " m";
  }
}

/// A forklift goes ahead at the vehicle's own pace, and nothing else faces along the way.
test::Drive convoy() {
  test::World world;
  world.room = aisle().room;
  world.movers = {forklift(0.0, -5.0, -kSpeed, kRest)};
  return test::simulate(world, test::straight_drive(kRest, kSpeed), 9.0, test::Sensors{.range_sigma = 0.02}, 1);
}

/// It holds the vehicle until the IMU is heard, unless it is found to move.
TEST(LioMovers, WhenTheImuIsHeardOnlyWhatWasHeldIsDeadReckoned) {
  const test::Drive drive = convoy();
  FrontendConfig config = test::tuned_config();
  config.moving_surface_sigma = 0.0;
  const test::LioRun run = test::run_lio(config, drive);
  double changed = 0.0;  // m/s along the way, at once
  double across = 0.0;   // m, largest step from scan to scan that is none of the drive
  for (std::size_t i = 1; i < run.scans.size(); ++i) {
    const ScanResult& last = run.scans[i - 1];
    const ScanResult& scan = run.scans[i];
    if (!last.has_state || !scan.has_state) continue;
    const auto off = [&](const ScanResult& at) -> Eigen::Vector3d {
      return at.state.T_odom_body.translation - drive.truth(test::drive_seconds(drive, at.state.utime)).translation;
    };
    changed = std::max(changed, std::abs(last.state.v_odom.z() - scan.state.v_odom.z()));
    across = std::max(across, (off(scan) - off(last)).head<2>().norm());
  }
  EXPECT_GT(changed, 0.3) << "else nobody was heard";
  EXPECT_LT(across, 0.03) << "walls and floor held the rest all the time";
}

struct Honesty {
  double sigmas = 0.0;  ///< along the way, at the worst, beside a centimetre
  double silent = 0.0;  ///< [m] largest error of a pose that is OK
};

Honesty honesty_along(const test::Drive& drive, const test::LioRun& run) {
  Honesty honesty;
  for (const ScanResult& scan : run.scans) {
    if (!scan.has_state) continue;
    const Pose truth = drive.truth(test::drive_seconds(drive, scan.state.utime));
    const double error = std::abs(scan.state.T_odom_body.translation.z() - truth.translation.z());
    honesty.sigmas = std::max(honesty.sigmas, error / std::sqrt(1e-4 + scan.covariance(kPosition + 2, kPosition + 2)));
    if (scan.trust == Trust::kOk) honesty.silent = std::max(honesty.silent, error);
  }
  return honesty;
}

/// Without that the state is OK a metre off.
TEST(LioMovers, AForkliftAheadAtTheVehiclesOwnPaceIsFoundToMoveAtOnce) {
  const test::Drive drive = convoy();
  EXPECT_LT(honesty_along(drive, test::run_lio(test::tuned_config(), drive)).silent, 0.1);
}

/// People on both sides of the way, most of what faces it, in a hall whose walls are out of range.
test::World crowd(std::uint32_t seed) {
  test::World world;
  world.room = {{-20.0, -0.6, -70.0}, {20.0, 7.4, 50.0}};
  for (int i = -3; i < 7; ++i) {
    for (const double x : {-8.0, 8.0}) world.pillars.push_back({x, -10.0 * i, 0.3});
  }
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> aside(1.2, 4.5);
  std::uniform_real_distribution<double> ahead(-50.0, 20.0);
  std::uniform_real_distribution<double> speed(0.6, 1.6);
  for (int i = 0; i < 80; ++i) {
    const double x = i % 2 == 0 ? aside(random) : -aside(random);
    const double z = ahead(random);
    const double velocity = i % 4 < 2 ? speed(random) : -speed(random);
    world.movers.push_back({{{x - 0.25, -0.6, z - 0.2}, {x + 0.25, 1.1, z + 0.2}}, {0.0, 0.0, velocity}});
  }
  return world;
}

/// They would take the vehicle with them, to and fro, and the covariance would shrink with each scan: 79 to 257 sigma,
/// up to 20 m off while OK.
TEST(LioMovers, AmongPeopleAPoseThatIsFarOffIsNotOk) {
  for (std::uint32_t seed = 1; seed <= 3; ++seed) {
    const test::Drive drive = test::simulate(crowd(seed), test::straight_drive(kRest, kSpeed), 25.0,
                                             test::Sensors{.range_sigma = 0.02}, seed);
    const test::LioRun run = test::run_lio(test::tuned_config(), drive);
    const Honesty honesty = honesty_along(drive, run);
    EXPECT_LT(honesty.sigmas, 15.0) << "seed " << seed;
    EXPECT_LT(honesty.silent, 0.5) << "seed " << seed;
  }
}

}  // namespace
}  // namespace ignis
