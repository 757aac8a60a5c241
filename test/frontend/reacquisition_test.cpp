// SPDX-License-Identifier: Apache-2.0
#include "frontend/reacquisition.h"

#include <gtest/gtest.h>

#include <random>

#include "common/so3.h"
#include "frontend/scan_matcher.h"
#include "frontend/standing_sensor.h"

namespace ignis {
namespace {

using test::StandingSensor;

FilterState predicted_at(const Pose& pose, double position_sigma, double attitude_sigma) {
  FilterState filter;
  filter.nominal.T_odom_body = pose;
  filter.covariance.setIdentity();
  filter.covariance.diagonal().segment<3>(kAttitude).setConstant(attitude_sigma * attitude_sigma);
  filter.covariance.diagonal().segment<3>(kPosition).setConstant(position_sigma * position_sigma);
  return filter;
}

TEST(Reacquisition, FindsThePlaceThatTheMatcherAloneMisses) {
  const StandingSensor standing;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  int missed = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Vector3d shift = 0.25 * Eigen::Vector3d(normal(random), 0.3 * normal(random), normal(random));
    const Pose wrong{so3::exp(0.01 * Eigen::Vector3d(normal(random), normal(random), normal(random))), shift};
    const FilterState predicted = predicted_at(wrong, 0.25, 0.01);
    const Pose found = reacquire(predicted, standing.newest_two, standing.map, standing.config);
    EXPECT_LT(found.translation.norm(), 0.05) << "from " << shift.transpose();

    const auto match = [&](const Pose& start) {
      return ScanMatcher(standing.config).match(predicted, start, standing.newest_two, standing.map);
    };
    const MatchResult with = match(found);
    EXPECT_TRUE(with.stats.applied());
    EXPECT_LT(with.filter.nominal.T_odom_body.translation.norm(), 0.02);
    const MatchResult without = match(wrong);
    missed += without.stats.applied() && without.filter.nominal.T_odom_body.translation.norm() > 0.1 ? 1 : 0;
  }
  EXPECT_GT(missed, 2) << "the fault that is guarded against: applied, and wrong";
}

TEST(Reacquisition, LeavesACertainPredictionAlone) {
  const StandingSensor standing;
  const Pose near{Eigen::Quaterniond::Identity(), {0.03, 0.0, 0.02}};
  const Pose start = reacquire(predicted_at(near, 0.02, 0.001), standing.newest_two, standing.map, standing.config);
  EXPECT_EQ(start.translation, near.translation);
}

TEST(Reacquisition, StaysWithThePredictionWhereThereIsNoMap) {
  const StandingSensor standing;
  const LocalMap empty(standing.config);
  const Pose pose{Eigen::Quaterniond::Identity(), {1.0, 0.0, 2.0}};
  const Pose start = reacquire(predicted_at(pose, 1.0, 0.1), standing.newest_two, empty, standing.config);
  EXPECT_EQ(start.translation, pose.translation);
}

}  // namespace
}  // namespace ignis
