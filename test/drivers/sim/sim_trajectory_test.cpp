// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/trajectory.h"

#include <gtest/gtest.h>

#include "common/config_check.h"
#include "common/frames.h"
#include "common/so3.h"

namespace ignis::sim {
namespace {

/// Corners to both sides, a slope, two stops and two speeds.
TrajectoryConfig winding_drive() {
  TrajectoryConfig config;
  config.corner_m = 2.0;
  config.tilt_deg = 1.0;
  config.waypoints = {{.position_m = {0, 0.6, 0}, .rest_s = 5.0},
                      {.position_m = {0, 0.6, -10}, .speed_m_s = 1.5},
                      {.position_m = {8, 0.6, -10}, .rest_s = 2.0},
                      {.position_m = {8, 2.0, -22}},
                      {.position_m = {-3, 2.0, -25}, .rest_s = 1.0}};
  return config;
}

TEST(Trajectory, HasDerivativesThatAgreeWithNumericalDifferentiation) {
  const Trajectory drive(winding_drive());
  constexpr double kStep = 1e-4;
  for (double t = 0.05; t < drive.duration(); t += 0.0371) {
    const Motion before = drive.at(t - kStep);
    const Motion now = drive.at(t);
    const Motion after = drive.at(t + kStep);
    const Eigen::Vector3d v = (after.T_world_body.translation - before.T_world_body.translation) / (2.0 * kStep);
    const Eigen::Vector3d a = (after.v_world - before.v_world) / (2.0 * kStep);
    const Eigen::Vector3d rate =
        so3::log(before.T_world_body.rotation.conjugate() * after.T_world_body.rotation) / (2.0 * kStep);
    const Eigen::Vector3d rate_derivative = (after.rate_body - before.rate_body) / (2.0 * kStep);
    EXPECT_LT((now.v_world - v).norm(), 1e-6) << t;
    EXPECT_LT((now.a_world - a).norm(), 1e-6) << t;
    EXPECT_LT((now.rate_body - rate).norm(), 1e-6) << t;
    EXPECT_LT((now.rate_derivative_body - rate_derivative).norm(), 1e-5) << t;
  }
}

TEST(Trajectory, IsSmoothInAccelerationAndAngularAcceleration) {
  const Trajectory drive(winding_drive());
  constexpr double kStep = 1e-3;
  Motion last = drive.at(0.0);
  for (double t = kStep; t < drive.duration() + 1.0; t += kStep) {
    const Motion now = drive.at(t);
    // A jump would be a few tenths; the steepest smooth change of this drive stays well below.
    EXPECT_LT((now.a_world - last.a_world).norm(), 0.01) << t;
    EXPECT_LT((now.rate_derivative_body - last.rate_derivative_body).norm(), 0.02) << t;
    last = now;
  }
}

TEST(Trajectory, StandsTrulyStillWhileItRests) {
  const Trajectory drive(winding_drive());
  const Motion start = drive.at(0.0);
  for (const double t : {-1.0, 0.001, 2.5, 4.999}) {
    const Motion motion = drive.at(t);
    EXPECT_EQ(motion.T_world_body.translation, start.T_world_body.translation);
    EXPECT_EQ(motion.T_world_body.rotation.coeffs(), start.T_world_body.rotation.coeffs());
    EXPECT_EQ(motion.v_world.norm() + motion.a_world.norm() + motion.rate_body.norm(), 0.0);
  }
  EXPECT_GT(drive.at(6.0).v_world.norm(), 0.1);
  const Motion end = drive.at(drive.duration() - 0.5);
  EXPECT_EQ(end.v_world.norm(), 0.0);
  EXPECT_EQ(drive.at(drive.duration() + 10.0).T_world_body.translation, end.T_world_body.translation);
}

TEST(Trajectory, BeginsEndsAndRestsWhereTheWaypointsSay) {
  const Trajectory drive(winding_drive());
  EXPECT_LT((drive.at(0.0).T_world_body.translation - Eigen::Vector3d(0, 0.6, 0)).norm(), 1e-9);
  EXPECT_LT((drive.at(drive.duration()).T_world_body.translation - Eigen::Vector3d(-3, 2, -25)).norm(), 1e-9);
  double longest_rest = 0.0;
  double rest = 0.0;
  for (double t = 10.0; t < drive.duration() - 3.0; t += 0.01) {
    rest = drive.at(t).v_world.norm() == 0.0 ? rest + 0.01 : 0.0;
    longest_rest = std::max(longest_rest, rest);
  }
  EXPECT_NEAR(longest_rest, 2.0, 0.03);
}

TEST(Trajectory, PointsAlongItsTravel) {
  TrajectoryConfig config = winding_drive();
  config.tilt_deg = 0.0;
  const Trajectory drive(config);
  for (double t = 5.5; t < drive.duration(); t += 0.1) {
    const Motion motion = drive.at(t);
    if (motion.v_world.norm() < 1e-3) continue;
    const Eigen::Vector3d forward = motion.T_world_body.rotation * -Eigen::Vector3d::UnitZ();
    EXPECT_LT((forward - motion.v_world.normalized()).norm(), 1e-6) << t;
    EXPECT_NEAR(frames::to_yaw_pitch_roll(motion.T_world_body.rotation).roll, 0.0, 1e-9);
  }
}

TEST(Trajectory, ReachesItsSpeeds) {
  const Trajectory drive(winding_drive());
  EXPECT_NEAR(drive.at(10.0).v_world.norm(), 1.0, 1e-6);
  double fastest = 0.0;
  for (double t = 0.0; t < drive.duration(); t += 0.05) fastest = std::max(fastest, drive.at(t).v_world.norm());
  EXPECT_NEAR(fastest, 1.5, 1e-3);
}

TEST(Trajectory, DrivesFromTheFirstInstantWithoutARest) {
  TrajectoryConfig config = winding_drive();
  config.waypoints[0].rest_s = 0.0;
  EXPECT_NEAR(Trajectory(config).at(0.0).v_world.norm(), 1.0, 1e-9);
}

TEST(Trajectory, LengthIsThatOfTheDrivenPath) {
  TrajectoryConfig config;
  config.waypoints = {{.position_m = {0, 0.6, 0}}, {.position_m = {0, 0.6, -30}}};
  EXPECT_NEAR(Trajectory(config).length(), 30.0, 1e-9);
}

TEST(Trajectory, RefusesWhatCannotBeDriven) {
  TrajectoryConfig back_and_forth = winding_drive();
  back_and_forth.waypoints = {{.position_m = {0, 0.6, 0}}, {.position_m = {0, 0.6, -20}}, {.position_m = {0, 0.6, 0}}};
  EXPECT_THROW(Trajectory{back_and_forth}, config::ConfigError);

  TrajectoryConfig too_fast = winding_drive();
  too_fast.speed_m_s = 8.0;
  EXPECT_THROW(Trajectory{too_fast}, config::ConfigError);

  TrajectoryConfig twice = winding_drive();
  twice.waypoints[1].position_m = {0, 0.6, -0.1};
  EXPECT_THROW(Trajectory{twice}, config::ConfigError);

  EXPECT_THROW(Trajectory{TrajectoryConfig{}}, config::ConfigError);
}

}  // namespace
}  // namespace ignis::sim
