// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/sighted_speed_factor.h"

#include <gtest/gtest.h>
#include <gtsam/base/numericalDerivative.h>
#include <gtsam/geometry/Pose3.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

#include "backend/factors/gtsam_conversion.h"
#include "backend/smoother.h"
#include "backend/synthetic_drive.h"
#include "common/so3.h"

namespace ignis {
namespace {

using Factor = gtsam::NoiseModelFactorN<gtsam::Pose3, gtsam::Vector3>;

const SightedSpeed kSighted{.axis = {0.6, 0.0, -0.8}, .speed = 1.2, .variance = 0.04};

TEST(SightedSpeedFactor, HasTheDerivativesThatDifferencesGive) {
  const auto made = make_sighted_speed_factor(0, 1, kSighted);
  const auto& factor = dynamic_cast<const Factor&>(*made);
  const gtsam::Pose3 pose = to_gtsam({so3::exp({0.3, -0.8, 0.2}), {1.0, 2.0, 3.0}});
  const gtsam::Vector3 velocity(0.4, -0.1, 1.7);
  gtsam::Matrix by_pose;
  gtsam::Matrix by_velocity;
  static_cast<void>(factor.evaluateError(pose, velocity, by_pose, by_velocity));
  const auto error = [&](const gtsam::Pose3& T, const gtsam::Vector3& v) { return factor.evaluateError(T, v); };
  EXPECT_TRUE(gtsam::assert_equal(
      gtsam::numericalDerivative21<gtsam::Vector, gtsam::Pose3, gtsam::Vector3>(error, pose, velocity), by_pose, 1e-7));
  EXPECT_TRUE(gtsam::assert_equal(
      gtsam::numericalDerivative22<gtsam::Vector, gtsam::Pose3, gtsam::Vector3>(error, pose, velocity), by_velocity,
      1e-7));
}

TEST(SightedSpeedFactor, IsTheSpeedAlongTheBodysAxisInSigmas) {
  const auto made = make_sighted_speed_factor(0, 1, kSighted);
  const auto& factor = dynamic_cast<const Factor&>(*made);
  const Eigen::Quaterniond R = so3::exp({0.3, -0.8, 0.2});
  const gtsam::Pose3 pose = to_gtsam({R, {1.0, 2.0, 3.0}});
  const gtsam::Vector3 across(0.8, 3.0, 0.6);
  const gtsam::Vector3 velocity = R * (1.5 * kSighted.axis + across);
  EXPECT_NEAR(factor.evaluateError(pose, velocity)(0), 0.3, 1e-12);
  EXPECT_NEAR(factor.noiseModel()->whiten(gtsam::Vector1(0.3))(0), 1.5, 1e-12);
}

constexpr double kForwardSpeed = 2.0;

/// A drive of whose way ahead (-z) scans say nothing.
testing::Drive blind_drive() {
  testing::Drive drive = testing::make_drive({.keyframes = 30, .speed = kForwardSpeed, .accel_noise = 0.2});
  for (Keyframe& keyframe : drive.keyframes) {
    if (keyframe.id == 0) continue;
    keyframe.scan_information = 1e6 * Matrix6d::Identity();
    keyframe.scan_information(5, 5) = 0.0;
  }
  return drive;
}

std::vector<Pose> smoothed(const std::vector<Keyframe>& keyframes) {
  Smoother smoother{BackendConfig(), LoopGates()};
  for (const Keyframe& keyframe : keyframes) EXPECT_EQ(smoother.add_keyframe(keyframe).reason, "");
  std::vector<Pose> poses;
  for (const KeyframePose& pose : smoother.all_poses()) poses.push_back(pose.T_map_body);
  return poses;
}

TEST(SightedSpeed, TakesBackWhatTheWayBeforeItHasDrifted) {
  testing::Drive drive = blind_drive();
  const double untold = testing::position_error(smoothed(drive.keyframes), drive.T_world_body);
  for (const std::size_t i : {9U, 14U, 19U, 24U, 29U}) {
    drive.keyframes[i].sighted = SightedSpeed{.axis = {0, 0, -1}, .speed = kForwardSpeed, .variance = 1e-3};
  }
  const double told = testing::position_error(smoothed(drive.keyframes), drive.T_world_body);
  RecordProperty("untold_mm", static_cast<int>(1e3 * untold));
  RecordProperty("told_mm", static_cast<int>(1e3 * told));
  EXPECT_LT(told, 0.5 * untold) << untold;
}

}  // namespace
}  // namespace ignis
