// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/spinning_beams.h"

#include <numbers>

#include <gtest/gtest.h>

#include "common/config_check.h"
#include "common/config_json.h"
#include "drivers/sim/lidar_config.h"

namespace ignis::sim {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

std::string offences_of(const LidarConfig& lidar) {
  try {
    config::require_valid(lidar, "lidar");
  } catch (const config::ConfigError& error) {
    return error.what();
  }
  return "";
}

LidarConfig spinning() {
  LidarConfig lidar;
  lidar.model = "spinning";
  return lidar;
}

TEST(ColumnDirections, LieEvenlyFromTheLowestToTheHighestBeam) {
  const std::vector<Eigen::Vector3d> directions =
      column_directions({.beams = 16, .lowest_deg = -15.0, .highest_deg = 15.0});
  ASSERT_EQ(directions.size(), 16U);
  for (std::size_t i = 0; i < directions.size(); ++i) {
    EXPECT_NEAR(directions[i].norm(), 1.0, 1e-12);
    EXPECT_NEAR(directions[i].y(), 0.0, 1e-12);
    EXPECT_NEAR(std::asin(directions[i].z()), kDegree * (-15.0 + 2.0 * static_cast<double>(i)), 1e-12);
  }
}

TEST(ColumnDirections, FollowTheListOfBeams) {
  const std::vector<Eigen::Vector3d> directions =
      column_directions({.angles = {{.elevation_deg = 30.0}, {.elevation_deg = 0.0, .azimuth_deg = 3.0}}});
  ASSERT_EQ(directions.size(), 2U);
  EXPECT_LT((directions[0] - Eigen::Vector3d(std::sqrt(0.75), 0.0, 0.5)).norm(), 1e-12);
  EXPECT_LT((directions[1] - Eigen::Vector3d(std::cos(3 * kDegree), std::sin(3 * kDegree), 0.0)).norm(), 1e-12);
}

TEST(Columns, TurnToTheRightOnceInEachPeriod) {
  const SpinningConfig config{.rate_hz = 10.0, .columns = 1000, .start_deg = 90.0};
  EXPECT_NEAR(column_azimuth(config, 0), 90.0 * kDegree, 1e-12);
  EXPECT_NEAR(column_azimuth(config, 250), 0.0, 1e-12);
  EXPECT_EQ(column_azimuth(config, 7), column_azimuth(config, 36'000'000'007));
  EXPECT_NEAR(column_time_us(config, 1000), 1e5, 1e-9);
  EXPECT_NEAR(column_time_us(config, 1), 100.0, 1e-9);
}

TEST(LidarConfig, NamesEveryOffenceOfASpinningLidar) {
  LidarConfig lidar = spinning();
  lidar.spinning = {.beams = 8,
                    .lowest_deg = 10.0,
                    .highest_deg = -10.0,
                    .angles = {{.elevation_deg = 100.0}},
                    .rate_hz = 0.0,
                    .columns = 3,
                    .min_range_m = 5.0,
                    .max_range_m = 2.0,
                    .range_at_90_percent_m = 10.0};
  const std::string error = offences_of(lidar);
  for (const char* expected :
       {"spinning.beams", "spinning.highest_deg", "spinning.angles = 1 entries", "angles[0].elevation_deg",
        "spinning.rate_hz", "spinning.columns", "spinning.max_range_m", "spinning.range_at_90_percent_m"}) {
    EXPECT_NE(error.find(expected), std::string::npos) << expected << " in: " << error;
  }
}

TEST(LidarConfig, RefusesSettingsOfTheModelThatIsNotInUse) {
  LidarConfig lidar = spinning();
  EXPECT_EQ(offences_of(lidar), "");
  lidar.l1.yaw_rate_hz = 9.0;
  lidar.l1.range_noise_m = 0.1;
  EXPECT_NE(offences_of(lidar).find("lidar = yaw_rate_hz, range_noise_m"), std::string::npos) << offences_of(lidar);
  LidarConfig other;
  EXPECT_EQ(offences_of(other), "");
  other.spinning.beams = 32;
  EXPECT_NE(offences_of(other).find("lidar.spinning = beams"), std::string::npos) << offences_of(other);
}

TEST(LidarConfig, StillChecksTheOpticsOfAnL1) {
  LidarConfig lidar;
  lidar.l1.range_at_90_percent_m = 5.0;
  EXPECT_NE(offences_of(lidar).find("lidar.range_at_90_percent_m"), std::string::npos) << offences_of(lidar);
}

}  // namespace
}  // namespace ignis::sim
