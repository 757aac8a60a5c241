// SPDX-License-Identifier: Apache-2.0
//
// Traffic in an aisle. The walls say nothing about the way along it, the end does a little, and what goes by says much
// that is not so.
#include <algorithm>
#include <cmath>

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

/// A forklift that goes ahead at the vehicle's own pace holds it, where nothing else faces along the way, until the IMU
/// is heard.
TEST(LioMovers, WhenTheImuIsHeardOnlyWhatWasHeldIsDeadReckoned) {
  test::World world;
  world.room = aisle().room;
  world.movers = {forklift(0.0, -5.0, -kSpeed, kRest)};
  test::Sensors sensors;
  sensors.range_sigma = 0.02;
  const test::Drive drive = test::simulate(world, test::straight_drive(kRest, kSpeed), 9.0, sensors, 1);
  const test::LioRun run = test::run_lio(test::tuned_config(), drive);
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

}  // namespace
}  // namespace ignis
