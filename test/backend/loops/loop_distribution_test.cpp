// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_distribution.h"

#include <gtest/gtest.h>

#include "backend/synthetic_drive.h"

namespace ignis {
namespace {

std::vector<Pose> odometry(const testing::Drive& drive) {
  std::vector<Pose> chain;
  for (const Keyframe& keyframe : drive.keyframes) chain.push_back(keyframe.state.T_odom_body);
  return chain;
}

TEST(LoopDistribution, ClosesTheLoopAndReducesDrift) {
  const testing::Drive drive = testing::make_drive({.seed = 4, .keyframes = 30});
  const std::vector<Pose> chain = odometry(drive);
  const Pose T_loop = drive.T_world_body[1].inverse() * drive.T_world_body[22];
  const auto corrected = distribute_loop_correction(chain, {1, 22, T_loop}, 5.0);
  ASSERT_TRUE(corrected);
  const Vector6d left = body_difference((*corrected)[1] * T_loop, (*corrected)[22]);
  EXPECT_LT(left.norm(), 1e-9);
  EXPECT_LT(testing::position_error(*corrected, drive.T_world_body),
            0.7 * testing::position_error(chain, drive.T_world_body));
}

TEST(LoopDistribution, WeighsByTheDistanceDrivenAndMovesTheRestRigidly) {
  std::vector<Pose> chain(5);
  const double places[] = {0.0, 1.0, 3.0, 4.0, 6.0};
  for (std::size_t i = 0; i < 5; ++i) chain[i].translation.z() = -places[i];
  Pose T_loop = chain[3];
  T_loop.translation.x() = 0.4;
  const auto corrected = distribute_loop_correction(chain, {0, 3, T_loop}, 2.0);
  ASSERT_TRUE(corrected);
  const double expected[] = {0.0, 0.1, 0.3, 0.4, 0.4};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR((*corrected)[i].translation.x(), expected[i], 1e-12);
    EXPECT_NEAR((*corrected)[i].translation.z(), -places[i], 1e-12);
  }
}

TEST(LoopDistribution, SharesARotationAmongPosesThatStandStill) {
  const std::vector<Pose> chain(3);
  Pose T_loop;
  T_loop.rotation = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY());
  const auto corrected = distribute_loop_correction(chain, {0, 2, T_loop}, 2.0);
  ASSERT_TRUE(corrected);
  EXPECT_NEAR((*corrected)[1].rotation.angularDistance(Eigen::Quaterniond::Identity()), 0.1, 1e-9);
  EXPECT_NEAR((*corrected)[2].rotation.angularDistance(T_loop.rotation), 0.0, 1e-7);
}

TEST(LoopDistribution, RefusesWhatIsTooFarOrNoLoop) {
  const std::vector<Pose> chain(3);
  Pose far;
  far.translation.x() = 2.1;
  EXPECT_FALSE(distribute_loop_correction(chain, {0, 2, far}, 2.0));
  EXPECT_FALSE(distribute_loop_correction(chain, {2, 2, Pose()}, 2.0));
  EXPECT_FALSE(distribute_loop_correction(chain, {0, 3, Pose()}, 2.0));
}

}  // namespace
}  // namespace ignis
