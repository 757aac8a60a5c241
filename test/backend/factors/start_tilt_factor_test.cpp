// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/start_tilt_factor.h"

#include <gtest/gtest.h>
#include <gtsam/base/numericalDerivative.h>
#include <gtsam/geometry/Pose3.h>
#include <gtsam/navigation/ImuBias.h>
#include <gtsam/nonlinear/NonlinearFactor.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "backend/factors/gtsam_conversion.h"
#include "backend/smoother.h"
#include "backend/synthetic_drive.h"
#include "common/so3.h"

namespace ignis {
namespace {

using gtsam::imuBias::ConstantBias;
using Factor = gtsam::NoiseModelFactorN<gtsam::Pose3, ConstantBias>;

constexpr double kGravity = 9.81;

NavState tilted_start() {
  NavState start;
  start.T_odom_body.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.3, 0.9, -0.2).normalized()));
  start.T_odom_body.translation = Eigen::Vector3d(1.0, 2.0, 3.0);
  start.accel_bias = Eigen::Vector3d(0.02, -0.05, 0.1);
  return start;
}

TEST(StartTiltFactor, HasTheDerivativesThatDifferencesGive) {
  const NavState start = tilted_start();
  const auto made = make_start_tilt_factor(0, 1, start, kGravity, 0.06);
  const auto& factor = dynamic_cast<const Factor&>(*made);
  const gtsam::Vector6 moved = (gtsam::Vector6() << 0.02, -0.03, 0.01, 0.5, -0.2, 0.1).finished();
  const gtsam::Pose3 pose = to_gtsam(start.T_odom_body).retract(moved);
  const ConstantBias bias(gtsam::Vector3(0.1, 0.2, -0.1), gtsam::Vector3(0.01, 0.0, 0.02));
  gtsam::Matrix by_pose;
  gtsam::Matrix by_bias;
  static_cast<void>(factor.evaluateError(pose, bias, by_pose, by_bias));
  const auto error = [&](const gtsam::Pose3& T, const ConstantBias& b) { return factor.evaluateError(T, b); };
  EXPECT_TRUE(gtsam::assert_equal(
      gtsam::numericalDerivative21<gtsam::Vector, gtsam::Pose3, ConstantBias>(error, pose, bias), by_pose, 1e-7));
  EXPECT_TRUE(gtsam::assert_equal(
      gtsam::numericalDerivative22<gtsam::Vector, gtsam::Pose3, ConstantBias>(error, pose, bias), by_bias, 1e-7));
}

TEST(StartTiltFactor, TakesABiasForATiltOfItsShareOfGravity) {
  const NavState start = tilted_start();
  const auto made = make_start_tilt_factor(0, 1, start, kGravity, 0.06);
  const auto& factor = dynamic_cast<const Factor&>(*made);
  const Eigen::Vector3d reading = start.T_odom_body.rotation.conjugate() * Eigen::Vector3d(0.0, kGravity, 0.0);
  const Eigen::Vector3d tilt = 0.004 * reading.unitOrthogonal();  // body axes
  const gtsam::Pose3 true_pose =
      to_gtsam(start.T_odom_body).retract((gtsam::Vector6() << tilt, gtsam::Z_3x1).finished());
  const ConstantBias hidden(start.accel_bias + tilt.cross(reading), gtsam::Z_3x1);
  EXPECT_LT(factor.evaluateError(true_pose, hidden).norm(), 1e-4);
  EXPECT_NEAR(factor.evaluateError(true_pose, ConstantBias(start.accel_bias, gtsam::Z_3x1)).norm(), 0.004 * kGravity,
              1e-4);
}

/// The squared error of the tilt over its variance, per axis, of a vehicle that has stood for ten seconds with a bias
/// that nobody knows; it is level, and its first attitude comes from what it read.
double squared_tilt_error(const BackendConfig& config, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double tilt = config.prior_tilt_deg * std::numbers::pi / 180.0;
  const double noise = std::sqrt(std::pow(kGravity * tilt, 2) - std::pow(config.prior_accel_bias, 2));
  const Eigen::Vector3d bias(config.prior_accel_bias * normal(random), 0.0, config.prior_accel_bias * normal(random));
  const Eigen::Vector3d reading = bias + Eigen::Vector3d(noise * normal(random), kGravity, noise * normal(random));
  const Eigen::Quaterniond attitude = Eigen::Quaterniond::FromTwoVectors(reading, Eigen::Vector3d::UnitY());
  Smoother smoother(config, LoopGates());
  SmootherUpdate last;
  for (Keyframe& keyframe : testing::make_rest(11, static_cast<unsigned>(random()))) {
    keyframe.state.T_odom_body.rotation = attitude;
    keyframe.scan_information = 1e6 * Matrix6d::Identity();  // scans see that nothing turns
    for (ImuSample& sample : keyframe.imu) sample.accel += bias;
    last = smoother.add_keyframe(keyframe);
  }
  EXPECT_TRUE(last.covariance_valid);
  const Eigen::Vector3d error = so3::log(last.newest.T_odom_body.rotation);
  return 0.5 * (error.x() * error.x() / last.covariance(0, 0) + error.z() * error.z() / last.covariance(2, 2));
}

TEST(StartTilt, IsAsUncertainAfterARestAsTheBiasThatMayHideInIt) {
  BackendConfig config;
  config.prior_tilt_deg = 0.5;
  config.prior_accel_bias = 0.06;
  constexpr int kStarts = 300;
  double sum = 0.0;
  std::mt19937 random(1);
  for (int i = 0; i < kStarts; ++i) sum += squared_tilt_error(config, random);
  EXPECT_GT(sum / kStarts, 0.89);  // 95 % of chi-square with 600 degrees of freedom
  EXPECT_LT(sum / kStarts, 1.12);  // two independent priors: 1.5
}

}  // namespace
}  // namespace ignis
