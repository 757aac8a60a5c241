// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframes/axis_doubt.h"

#include <gtest/gtest.h>

#include <cmath>

#include "backend/smoother.h"
#include "backend/synthetic_drive.h"
#include "common/so3.h"

namespace ignis {
namespace {

/// Of a pose that is known to `along` metres along z and to a millimetre across it.
Matrix6d open_along_z(double along) {
  Vector6d sigmas;
  sigmas << 0.002, 0.003, 0.002, 0.001, 0.001, along;
  Matrix6d covariance = sigmas.cwiseProduct(sigmas).asDiagonal();
  covariance(1, 3) = covariance(3, 1) = 1e-6;
  return covariance;
}

TEST(AxisDoubt, MakesOfMetresAlongACorridorMoreThanMillimetresAcrossIt) {
  const Matrix6d doubtful = with_axis_doubt(open_along_z(5.0));
  for (int i = 3; i < 5; ++i) {
    EXPECT_GT(std::sqrt(doubtful(i, i)), 0.005);
    EXPECT_LT(std::sqrt(doubtful(i, i)), 0.05);
  }
  EXPECT_NEAR(doubtful(5, 5), 25.0, 1e-4);
}

TEST(AxisDoubt, AddsNothingToSpeakOfWhereNoDirectionIsOpen) {
  const Matrix6d covariance = open_along_z(0.02);
  const Eigen::Matrix3d position = covariance.bottomRightCorner<3, 3>();
  EXPECT_LT((with_axis_doubt(covariance) - covariance).norm(), 1e-3 * position.norm());
}

TEST(AxisDoubt, LeavesAttitudeAndWhatItSharesWithThePosition) {
  const Matrix6d covariance = open_along_z(5.0);
  Matrix6d change = with_axis_doubt(covariance) - covariance;
  change.bottomRightCorner(3, 3).setZero();
  EXPECT_EQ(change.norm(), 0.0);
}

TEST(AxisDoubt, TurnsWithTheAxes) {
  Matrix6d turn = Matrix6d::Identity();
  turn.bottomRightCorner(3, 3) = so3::exp({0.3, -0.8, 0.5}).toRotationMatrix();
  const Matrix6d covariance = open_along_z(3.0);
  const Matrix6d turned = with_axis_doubt(turn * covariance * turn.transpose());
  EXPECT_LT((turned - turn * with_axis_doubt(covariance) * turn.transpose()).norm(), 1e-12);
}

TEST(Smoother, PublishesThatTheAxisOfACorridorIsKnownToAnAngleOnly) {
  testing::Drive drive = testing::make_drive({.keyframes = 2});
  BackendConfig config;
  config.imu.accel_noise = 10.0;  // so weak that what scans leave open is open by metres
  Matrix6d& information = drive.keyframes[1].scan_information;
  information *= 400.0;  // a millimetre
  information.row(5).setZero();
  information.col(5).setZero();
  Smoother smoother(config, LoopGates());
  static_cast<void>(smoother.add_keyframe(drive.keyframes[0]));
  const SmootherUpdate update = smoother.add_keyframe(drive.keyframes[1]);
  ASSERT_TRUE(update.covariance_valid);
  const double along = std::sqrt(update.covariance(5, 5));
  ASSERT_GT(along, 5.0);
  EXPECT_GT(std::sqrt(update.covariance(3, 3)), 0.001 * along);
  EXPECT_GT(std::sqrt(update.covariance(4, 4)), 0.001 * along);
}

}  // namespace
}  // namespace ignis
