// SPDX-License-Identifier: Apache-2.0
#include "frontend/recovery/place_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "frontend/standing_sensor.h"

namespace ignis {
namespace {

FilterState predicted_at(const Eigen::Vector3d& position, double sigma_m) {
  return test::predicted_at({Eigen::Quaterniond::Identity(), position}, sigma_m, 1.0);
}

TEST(PlaceSearch, PutsTheTruePlaceFirstWithinACell) {
  const test::StandingSensor standing;
  for (const Eigen::Vector3d& shift :
       {Eigen::Vector3d(1.3, 0.2, -0.9), Eigen::Vector3d(-2.0, -0.4, 1.1), Eigen::Vector3d(0.0, 0.0, 0.0)}) {
    const auto places = likely_places(predicted_at(shift, 0.8), standing.newest_two, standing.map, 8);
    ASSERT_FALSE(places.empty());
    EXPECT_LT(places.front().cwiseAbs().maxCoeff(), 0.2) << "from " << shift.transpose();
  }
}

TEST(PlaceSearch, KeepsToWhatThePredictionAllowsAndItsPlacesApart) {
  const test::StandingSensor standing;
  const Eigen::Vector3d position(0.4, 0.0, 0.2);
  const auto places = likely_places(predicted_at(position, 0.3), standing.newest_two, standing.map, 8);
  ASSERT_GT(places.size(), 2U);
  EXPECT_LE(places.size(), 8U);
  for (auto place = places.begin(); place != places.end(); ++place) {
    EXPECT_LE((*place - position).norm(), 4.0 * 0.3 + 1e-9);
    const auto near = [&](const Eigen::Vector3d& other) { return (other - *place).norm() <= 0.5; };
    EXPECT_TRUE(std::none_of(places.begin(), place, near));
  }
}

TEST(PlaceSearch, FindsNothingWithoutPointsAndOnlyThePredictionWithoutAMap) {
  const test::StandingSensor standing;
  EXPECT_TRUE(likely_places(predicted_at(Eigen::Vector3d::Zero(), 0.5), {}, standing.map, 8).empty());
  const LocalMap empty(standing.config);
  const Eigen::Vector3d position(1.0, 0.0, 2.0);
  const auto places = likely_places(predicted_at(position, 0.5), standing.newest_two, empty, 8);
  ASSERT_FALSE(places.empty());
  EXPECT_EQ(places.front(), position);
}

TEST(PlaceSearch, ASurePredictionAlongADiagonalLeavesPlacesAlongIt) {
  const test::StandingSensor standing;
  const Eigen::Vector3d along = Eigen::Vector3d(1.0, 0.0, 1.0).normalized();
  FilterState predicted = predicted_at(0.8 * along, 0.01);
  predicted.covariance.block<3, 3>(kPosition, kPosition) += along * along.transpose();
  const auto places = likely_places(predicted, standing.newest_two, standing.map, 8);
  ASSERT_GT(places.size(), 1U);
  EXPECT_LT(places.front().norm(), 0.3);
}

TEST(PlaceSearch, WhatWasRefusedHasNoVote) {
  const test::StandingSensor standing;
  LocalMap map = standing.map;
  const Eigen::Vector3d wrong(1.3, 0.2, -0.9);
  for (int i = 0; i < 5; ++i) map.insert(standing.newest_two, {Eigen::Quaterniond::Identity(), wrong}, false);
  const auto places = likely_places(predicted_at(wrong, 0.8), standing.newest_two, map, 8);
  ASSERT_FALSE(places.empty());
  EXPECT_LT(places.front().cwiseAbs().maxCoeff(), 0.2);
}

TEST(PlaceSearch, PointsOutOfReachHaveNoSay) {
  const test::StandingSensor standing;
  std::vector<Eigen::Vector3f> points = standing.newest_two;
  const auto before = likely_places(predicted_at({0.5, 0.0, 0.5}, 0.5), points, standing.map, 8);
  for (int i = 0; i < 5000; ++i) points.emplace_back(1e6F, 0.0F, static_cast<float>(i));
  EXPECT_EQ(likely_places(predicted_at({0.5, 0.0, 0.5}, 0.5), points, standing.map, 8), before);
}

}  // namespace
}  // namespace ignis
