// SPDX-License-Identifier: Apache-2.0
#include "frontend/recovery/reacquisition.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "common/so3.h"
#include "frontend/matching/scan_matcher.h"
#include "frontend/standing_sensor.h"

namespace ignis {
namespace {

using test::predicted_at;
using test::StandingSensor;

TEST(Reacquisition, FindsThePlaceThatTheMatcherAloneMisses) {
  const StandingSensor standing;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  int missed = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Vector3d shift = 0.25 * Eigen::Vector3d(normal(random), 0.3 * normal(random), normal(random));
    const Pose wrong{so3::exp(0.01 * Eigen::Vector3d(normal(random), normal(random), normal(random))), shift};
    const FilterState predicted = predicted_at(wrong, 0.25, 0.01);
    const Reacquisition place = reacquire(predicted, standing.newest_two, standing.map, standing.config);
    const Pose& found = place.T_odom_body;
    EXPECT_LT(found.translation.norm(), 0.05) << "from " << shift.transpose();
    const bool is_expected = shift.norm() < 3.0 * 0.25;
    EXPECT_EQ(place.doubtful.empty(), is_expected) << place.doubt;

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
  const Reacquisition start =
      reacquire(predicted_at(near, 0.02, 0.001), standing.newest_two, standing.map, standing.config);
  EXPECT_EQ(start.T_odom_body.translation, near.translation);
  EXPECT_TRUE(start.doubtful.empty());
}

TEST(Reacquisition, StaysWithThePredictionWhereThereIsNoMap) {
  const StandingSensor standing;
  const LocalMap empty(standing.config);
  const Pose pose{Eigen::Quaterniond::Identity(), {1.0, 0.0, 2.0}};
  const Reacquisition start = reacquire(predicted_at(pose, 1.0, 0.1), standing.newest_two, empty, standing.config);
  EXPECT_EQ(start.T_odom_body.translation, pose.translation);
  EXPECT_EQ(start.doubtful.size(), 3U);
  EXPECT_EQ(start.doubt, "place: 0 % of the points meet the map");
}

TEST(Reacquisition, GetsPastAPlaceThatLooksNearlyRight) {
  const StandingSensor standing;
  int misled = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const double angle = trial * 2.0 * std::numbers::pi / 12.0;
    const Eigen::Vector3d shift(2.2 * std::cos(angle), 0.2, 2.2 * std::sin(angle));
    const FilterState predicted = predicted_at({Eigen::Quaterniond::Identity(), shift}, 0.8, 0.005);
    const Reacquisition place = reacquire(predicted, standing.newest_two, standing.map, standing.config);
    EXPECT_LT(place.T_odom_body.translation.norm(), 0.1) << "from " << shift.transpose();
    const Pose near = approached(predicted, standing.newest_two, standing.map, standing.config);
    misled += near.translation.norm() > 0.3 ? 1 : 0;
  }
  EXPECT_GT(misled, 0) << "by the planes that are nearest to the prediction";
}

/// Bays of which seven are mapped, each from its middle.
struct Bays {
  Bays() {
    const test::Drive drive = test::simulate(test::bays(), test::straight_drive(10.0, 0.0), 2.0, test::Sensors{}, 3);
    for (std::size_t i = 0; i < 30; ++i) {
      std::vector<Eigen::Vector3f> points;
      for (const ScanPoint& point : drive.scans[i].points) points.push_back(point.position);
      for (int bay = -3; i < 28 && bay <= 3; ++bay) {
        map.insert(points, {Eigen::Quaterniond::Identity(), {0.0, 0.0, test::kBay * bay}}, true);
      }
      if (i >= 28) newest_two.insert(newest_two.end(), points.begin(), points.end());
    }
  }

  [[nodiscard]] Reacquisition reacquired_from(double along, double sigma_m) const {
    const Pose wrong{Eigen::Quaterniond::Identity(), {0.2, 0.0, along}};
    return reacquire(predicted_at(wrong, sigma_m, 0.005), newest_two, map, config);
  }

  FrontendConfig config = test::tuned_config();
  LocalMap map{config};
  std::vector<Eigen::Vector3f> newest_two;
};

TEST(Reacquisition, AmongBaysThatLookAlikeTheWayAlongThemIsDoubtful) {
  const Bays bays;
  for (const double along : {-0.75, -0.4, 0.0, 0.4, 0.75}) {
    const Reacquisition place = bays.reacquired_from(along, 1.0);
    ASSERT_EQ(place.doubtful.size(), 1U) << along << ": " << place.doubt;
    EXPECT_GT(std::abs(place.doubtful.front().z()), 0.99) << place.doubt;
    EXPECT_NE(place.doubt.find("where another fits as well"), std::string::npos) << place.doubt;
    const double bay = place.T_odom_body.translation.z() / test::kBay;
    EXPECT_LT(std::abs(bay - std::round(bay)), 0.1) << "in one of them, all the same";
    EXPECT_LT(std::abs(place.T_odom_body.translation.x()), 0.1);
  }
}

TEST(Reacquisition, APredictionThatIsSureOfItsBayLeavesNoDoubt) {
  const Reacquisition place = Bays().reacquired_from(0.3, 0.3);
  EXPECT_LT(place.T_odom_body.translation.norm(), 0.1);
  EXPECT_TRUE(place.doubtful.empty()) << place.doubt;
}

TEST(Reacquisition, WhereLittleOfTheMapIsInSightThePlaceIsDoubtful) {
  const StandingSensor standing;
  const StandingSensor elsewhere(test::street());
  const Reacquisition place =
      reacquire(predicted_at(Pose(), 0.6, 0.005), elsewhere.newest_two, standing.map, standing.config);
  EXPECT_EQ(place.doubtful.size(), 3U);
  EXPECT_NE(place.doubt.find("of the points meet the map"), std::string::npos) << place.doubt;
}

TEST(Reacquisition, APlaceWhosePlanesThePointsDoNotLieInIsDoubtful) {
  const StandingSensor standing;
  std::vector<Eigen::Vector3f> blurred = standing.newest_two;
  std::mt19937 random(1);
  std::normal_distribution<float> noise(1.0F, 0.03F);
  for (Eigen::Vector3f& point : blurred) point *= noise(random);
  const Reacquisition place = reacquire(predicted_at(Pose(), 0.6, 0.005), blurred, standing.map, standing.config);
  EXPECT_EQ(place.doubtful.size(), 3U);
  EXPECT_NE(place.doubt.find("lie in its planes"), std::string::npos) << place.doubt;
}

TEST(Reacquisition, APlaceThatMayBeFartherThanTheSearchReachesIsDoubtful) {
  const StandingSensor standing;
  const Reacquisition place =
      reacquire(predicted_at(Pose(), 1.5, 0.005), standing.newest_two, standing.map, standing.config);
  EXPECT_EQ(place.doubtful.size(), 3U);
  EXPECT_EQ(place.doubt, "place: searched within 4 of 6.0 m");
}

TEST(Reacquisition, APredictionThatIsNoNumberIsLeftToTheMatcher) {
  const StandingSensor standing;
  FilterState predicted = predicted_at(Pose(), 1.0, 0.005);
  predicted.covariance(kPosition, kPosition) = std::numeric_limits<double>::quiet_NaN();
  const Reacquisition place = reacquire(predicted, standing.newest_two, standing.map, standing.config);
  EXPECT_EQ(place.T_odom_body.translation, predicted.nominal.T_odom_body.translation);
}

TEST(Reacquisition, ASpinningLidarFindsItsPlaceInAStreetAndKnowsIt) {
  test::Sensors sensors;
  sensors.car = true;
  sensors.scan_hz = 10.0;
  sensors.max_range = 80.0;
  sensors.range_sigma = 0.02;
  const test::Drive drive = test::simulate(test::street(), test::straight_drive(10.0, 0.0), 2.0, sensors, 1);
  const FrontendConfig config = test::tuned_config();
  LocalMap map(config);
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < 10; ++i) {
    points.clear();
    for (const ScanPoint& point : drive.scans[i].points) points.push_back(point.position);
    if (i < 9) map.insert(points, Pose(), true);
  }
  const Pose wrong{Eigen::Quaterniond::Identity(), {0.5, 0.1, 1.0}};
  const Reacquisition place = reacquire(predicted_at(wrong, 0.7, 0.002), points, map, config);
  EXPECT_LT(place.T_odom_body.translation.norm(), 0.15);
  EXPECT_TRUE(place.doubtful.empty()) << place.doubt;
}

TEST(Reacquisition, APlaceThatThePredictionHardlyAllowsIsDoubtful) {
  const StandingSensor standing;
  const Pose wrong{Eigen::Quaterniond::Identity(), {0.0, 0.0, 1.75}};
  const Reacquisition place =
      reacquire(predicted_at(wrong, 0.5, 0.005), standing.newest_two, standing.map, standing.config);
  EXPECT_LT(place.T_odom_body.translation.norm(), 0.1);
  EXPECT_EQ(place.doubtful.size(), 3U);
  EXPECT_NE(place.doubt.find("sigma from where it was expected"), std::string::npos) << place.doubt;
}

}  // namespace
}  // namespace ignis
