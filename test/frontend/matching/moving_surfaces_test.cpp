// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/moving_surfaces.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

namespace ignis {
namespace {

const Eigen::Vector3d kUp = Eigen::Vector3d::UnitY();

/// Scans of a floor, of a wall along the way and of a few surfaces, each a metre wide, that face the way.
class Street {
 public:
  explicit Street(const FrontendConfig& config = {}) : judge(config) { know_speed_to(0.03); }

  /// One more scan in which the surfaces that face the way are off by so much [m]. How many of their points are left
  /// out.
  int scan(double distance, double age_s = 0.1, double seconds = 0.05) {
    std::vector<MatchedSurface> surfaces;
    std::normal_distribution<double> noise(0.0, 0.01);
    const auto add = [&](const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double off, double age) {
      surfaces.push_back(
          {.point = turn * point, .normal = turn * normal, .distance = off + noise(random_), .age_s = age});
    };
    for (int i = 0; i < 200; ++i) {
      add({0.1 * (i % 20), 0.0, -0.1 * i}, kUp, floor_is_off_by, 3.0);
      add({5.0, 0.01 * i, -0.1 * i}, -Eigen::Vector3d::UnitX(), 0.0, 3.0);
    }
    facing_from_ = surfaces.size();
    for (int patch = 0; patch < patches; ++patch) {
      for (int i = 0; i < 5; ++i) add({-3.0, 0.2 * i, -4.0 * patch}, Eigen::Vector3d::UnitZ(), distance, age_s);
    }
    prior.seconds = seconds;
    moved_ = judge.judge(surfaces, prior);
    return static_cast<int>(std::ranges::count(moved_, true));
  }
  void know_speed_to(double sigma) { prior.velocity_covariance = sigma * sigma * Eigen::Matrix3d::Identity(); }
  /// Of the last scan: nothing but surfaces that face the way is left out.
  [[nodiscard]] bool only_facing_ones_went() const {
    return std::find(moved_.begin(), moved_.end(), true) - moved_.begin() >= static_cast<std::ptrdiff_t>(facing_from_);
  }

  MovingSurfaces judge;
  PriorMotion prior{.position_covariance = 1e-4 * Eigen::Matrix3d::Identity()};
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  int patches = 4;
  double floor_is_off_by = 0.0;  ///< [m]

 private:
  std::mt19937 random_{1};
  std::vector<bool> moved_;
  std::size_t facing_from_ = 0;
};

TEST(MovingSurfaces, AreLeftOutWhereTheyAreTheFewThatFaceTheWay) {
  Street street;
  EXPECT_EQ(street.scan(0.1), 20);
  EXPECT_TRUE(street.only_facing_ones_went());
}

TEST(MovingSurfaces, AreFoundAlongAnyDirection) {
  Street street;
  street.turn = Eigen::AngleAxisd(0.7, kUp).toRotationMatrix();
  EXPECT_EQ(street.scan(-0.1), 20);
  EXPECT_TRUE(street.only_facing_ones_went());
}

TEST(MovingSurfaces, WhatStandsIsLeftAlone) {
  Street street;
  for (int i = 0; i < 200; ++i) EXPECT_EQ(street.scan(0.01), 0) << "scan " << i;
  EXPECT_FALSE(street.judge.is_restless());
}

TEST(MovingSurfaces, ASingleOneIsNoTraffic) {
  Street street;
  street.patches = 1;
  for (int i = 0; i < 50; ++i) EXPECT_EQ(street.scan(0.1), 0) << "scan " << i;
  EXPECT_FALSE(street.judge.is_restless());
}

TEST(MovingSurfaces, WhereManyFaceTheWayTheyAreBelieved) {
  Street street;
  street.patches = 40;
  for (int i = 0; i < 50; ++i) EXPECT_EQ(street.scan(0.1), 0) << "scan " << i;
  EXPECT_FALSE(street.judge.is_restless());
}

TEST(MovingSurfaces, AVehicleThatDoesNotKnowItsSpeedSeesAllMoveAndBelievesIt) {
  Street street;
  street.know_speed_to(1.0);
  street.prior.position_covariance = 0.0025 * Eigen::Matrix3d::Identity();  // of a twentieth of a second
  EXPECT_EQ(street.scan(0.1), 0);
}

TEST(MovingSurfaces, AVehicleThatDoesNotKnowItsSpeedFindsNoUnrest) {
  Street street;
  street.know_speed_to(0.2);
  for (int i = 0; i < 50; ++i) street.scan(0.2);
  EXPECT_FALSE(street.judge.is_restless());
}

TEST(MovingSurfaces, WhatIsOldHasNotMoved) {
  Street street;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(street.scan(0.4, 3.0), 0) << "the map or the pose is off";
  EXPECT_FALSE(street.judge.is_restless());
}

TEST(MovingSurfaces, WhereMoreThanTheFewIsOffThePoseIs) {
  Street street;
  street.floor_is_off_by = 0.2;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(street.scan(0.2), 0);
  EXPECT_FALSE(street.judge.is_restless());
}

TEST(MovingSurfaces, OldOnesMayBeOffByWhatThePositionIsUncertainBy) {
  Street street;
  street.prior.position_covariance = 0.25 * Eigen::Matrix3d::Identity();
  EXPECT_EQ(street.scan(0.4, 20.0), 0);
  EXPECT_EQ(street.scan(0.4, 1.5), 0);
  EXPECT_EQ(street.scan(0.4, 0.2), 20) << "those of a moment ago may not";
}

TEST(MovingSurfaces, MakeTheSceneRestlessForSomeSeconds) {
  Street street;
  for (int i = 0; i < 2; ++i) street.scan(0.1);
  EXPECT_FALSE(street.judge.is_restless());
  street.scan(0.1);
  EXPECT_TRUE(street.judge.is_restless());
  for (int i = 0; i < 80; ++i) street.scan(0.0);
  EXPECT_TRUE(street.judge.is_restless()) << "four seconds later";
  for (int i = 0; i < 30; ++i) street.scan(0.0);
  EXPECT_FALSE(street.judge.is_restless()) << "five and a half";
}

TEST(MovingSurfaces, WhatIsYoungIsNotBelievedInARestlessScene) {
  Street street;
  for (int i = 0; i < 3; ++i) street.scan(0.1);
  EXPECT_EQ(street.scan(0.0, 1.0), 20) << "a trail of what has moved may be as old";
  EXPECT_EQ(street.scan(0.0, 3.0), 0);
}

TEST(MovingSurfaces, ToFindNoneWithoutKnowingTheSpeedIsNoSignOfQuiet) {
  Street street;
  for (int i = 0; i < 3; ++i) street.scan(0.1);
  street.know_speed_to(0.5);
  for (int i = 0; i < 400; ++i) street.scan(0.1);
  EXPECT_TRUE(street.judge.is_restless());
}

TEST(MovingSurfaces, AScanThatIsJudgedOnceMoreCountsOnce) {
  Street street;
  for (int i = 0; i < 10; ++i) street.scan(0.1, 0.1, i == 0 ? 0.05 : 0.0);
  EXPECT_FALSE(street.judge.is_restless());
}

TEST(MovingSurfaces, AreNotLookedForWithoutALimit) {
  FrontendConfig config;
  config.moving_surface_sigma = 0.0;
  Street street(config);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(street.scan(0.5), 0);
  EXPECT_FALSE(street.judge.is_restless());
}

}  // namespace
}  // namespace ignis
