// SPDX-License-Identifier: Apache-2.0
#include "backend/keyframes/corrected_trajectory.h"

#include <gtest/gtest.h>

namespace ignis {
namespace {

Pose at(double x) { return {Eigen::Quaterniond::Identity(), {x, 0.0, 0.0}}; }

TEST(CorrectedTrajectory, InterpolatesTheCorrectionBetweenKeyframesAndHoldsItOutside) {
  const Trajectory odometry = {
      {0, at(0.0)}, {1'000'000, at(1.0)}, {2'000'000, at(2.0)}, {3'000'000, at(3.0)}, {4'000'000, at(4.0)}};
  // The first keyframe stays, the second one moves back by 0.4 m.
  const std::vector<KeyframeCorrection> keyframes = {{1'000'000, at(1.0), at(1.0)}, {3'000'000, at(3.0), at(2.6)}};
  const Trajectory corrected = corrected_trajectory(odometry, keyframes);
  const std::vector<double> expected = {0.0, 1.0, 1.8, 2.6, 3.6};
  ASSERT_EQ(corrected.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(corrected[i].utime, odometry[i].utime);
    EXPECT_NEAR(corrected[i].T_world_body.translation.x(), expected[i], 1e-12) << "row " << i;
  }
}

TEST(CorrectedTrajectory, IsTheOdometryWithoutKeyframes) {
  const Trajectory corrected = corrected_trajectory({{5, at(1.5)}}, {});
  ASSERT_EQ(corrected.size(), 1U);
  EXPECT_EQ(corrected[0].T_world_body.translation.x(), 1.5);
}

}  // namespace
}  // namespace ignis
