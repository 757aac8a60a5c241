// SPDX-License-Identifier: Apache-2.0
#include "common/frames.h"

#include <random>

#include <gtest/gtest.h>

namespace ignis {
namespace {

using frames::YawPitchRoll;

Eigen::Vector3d forward_after(const YawPitchRoll& attitude) {
  return frames::from_yaw_pitch_roll(attitude) * Eigen::Vector3d(0, 0, -1);
}

TEST(Frames, PositiveYawTurnsTheNoseLeft) { EXPECT_LT(forward_after({.yaw = 0.3, .pitch = 0, .roll = 0}).x(), 0.0); }

TEST(Frames, PositivePitchLiftsTheNose) { EXPECT_GT(forward_after({.yaw = 0, .pitch = 0.3, .roll = 0}).y(), 0.0); }

TEST(Frames, PositiveRollLowersTheRightSide) {
  const Eigen::Vector3d right =
      frames::from_yaw_pitch_roll({.yaw = 0, .pitch = 0, .roll = 0.3}) * Eigen::Vector3d(1, 0, 0);
  EXPECT_LT(right.y(), 0.0);
}

TEST(Frames, DecompositionInvertsComposition) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> turn(-3.1, 3.1);
  std::uniform_real_distribution<double> tilt(-1.5, 1.5);
  for (int i = 0; i < 100; ++i) {
    const YawPitchRoll wanted{.yaw = turn(random), .pitch = tilt(random), .roll = turn(random)};
    const YawPitchRoll found = frames::to_yaw_pitch_roll(frames::from_yaw_pitch_roll(wanted));
    EXPECT_NEAR(found.yaw, wanted.yaw, 1e-9);
    EXPECT_NEAR(found.pitch, wanted.pitch, 1e-9);
    EXPECT_NEAR(found.roll, wanted.roll, 1e-9);
  }
}

TEST(Frames, RosAxesMapToOurs) {
  const Eigen::Quaterniond q = frames::q_body_from_forward_left_up();
  EXPECT_LT((q * Eigen::Vector3d::UnitX() - Eigen::Vector3d(0, 0, -1)).norm(), 1e-12) << "forward";
  EXPECT_LT((q * Eigen::Vector3d::UnitY() - Eigen::Vector3d(-1, 0, 0)).norm(), 1e-12) << "left";
  EXPECT_LT((q * Eigen::Vector3d::UnitZ() - Eigen::Vector3d(0, 1, 0)).norm(), 1e-12) << "up";
}

TEST(Frames, VelocityReadsRightUpForward) {
  const Eigen::Quaterniond facing_left = frames::from_yaw_pitch_roll({.yaw = M_PI / 2, .pitch = 0, .roll = 0});
  const Eigen::Vector3d v = frames::right_up_forward(facing_left, {-2.0, 0.5, 0.0});
  EXPECT_LT((v - Eigen::Vector3d(0.0, 0.5, 2.0)).norm(), 1e-12);
}

}  // namespace
}  // namespace ignis
