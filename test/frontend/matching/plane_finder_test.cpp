// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "frontend/matching/plane_finder.h"
#include "frontend/matching/scan_matcher.h"

namespace ignis {
namespace {

constexpr double kHeight = 1.8;  // m, of a LiDAR above the floor

/// Of config/spinning.json.
FrontendConfig spinning_config() {
  FrontendConfig config;
  config.match_radius_m = 0.3;
  config.wide_match_radius_m = 0.6;
  config.line_match_radius_m = 1.5;
  config.min_plane_points = 5;
  config.max_curvature = 0.1;
  config.min_spread = 0.3;
  config.max_centroid_offset = 0.6;
  config.max_surface_roughness = 0.03;
  config.map_average_points = 60000;
  return config;
}

/// Where a beam below the horizon meets the floor, seen from a LiDAR at the origin.
Eigen::Vector3d on_floor(double below_deg, double azimuth) {
  const double radius = kHeight / std::tan(below_deg * std::numbers::pi / 180.0);
  return {radius * std::sin(azimuth), -kHeight, -radius * std::cos(azimuth)};
}

/// Ten turns of a LiDAR that stands, two beams or one of which meet the floor.
LocalMap map_of_rings(const FrontendConfig& config, const std::vector<double>& below_deg) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 0.02);
  LocalMap map(config);
  for (int turn = 0; turn < 10; ++turn) {
    std::vector<Eigen::Vector3f> points;
    for (int k = 0; k < 1800; ++k) {
      for (const double each : below_deg) {
        const Eigen::Vector3d point = on_floor(each, k * std::numbers::pi / 900.0);
        points.push_back((point * (1.0 + noise(random) / point.norm())).cast<float>());
      }
    }
    map.insert(points, {}, true);
  }
  return map;
}

class Rings {
 public:
  explicit Rings(const std::vector<double>& below_deg) : map_(map_of_rings(config_, below_deg)) {
    for (int k = 0; k < 60; ++k) queries_.push_back(on_floor(13.0, 0.1 * k));
  }

  std::span<const PlaneFit> near() { return finder_.find(map_, queries_, Eigen::Vector3d::Zero()); }
  std::span<const PlaneFit> across_lines() {
    return finder_.find_across_lines(map_, queries_, Eigen::Vector3d::Zero());
  }

 private:
  FrontendConfig config_ = spinning_config();
  LocalMap map_;
  PlaneFinder finder_{config_};
  std::vector<Eigen::Vector3d> queries_;
};

TEST(PlaneFinder, FindsTheFloorAcrossTwoRingsThatAreALineEach) {
  Rings rings({15.0, 13.0});
  for (const PlaneFit& plane : rings.near()) EXPECT_NE(plane.verdict, PlaneVerdict::kPlane);
  int found = 0;
  for (const PlaneFit& plane : rings.across_lines()) {
    if (plane.verdict != PlaneVerdict::kPlane) continue;
    ++found;
    EXPECT_GT(std::abs(plane.normal.y()), std::cos(0.02));
    EXPECT_NEAR(plane.normal.dot(plane.offset), 0.0, 0.01);
  }
  EXPECT_GT(found, 40);
}

TEST(PlaneFinder, TakesOneRingForALineHoweverFarItLooks) {
  Rings ring({13.0});
  for (const PlaneFit& plane : ring.across_lines()) EXPECT_EQ(plane.verdict, PlaneVerdict::kLine);
}

// A LiDAR of few beams that stands: the floor between its rings holds the tilt. Beside a wall that is seen everywhere
// nothing is looked for further off.
TEST(ScanMatcher, LooksAcrossLinesWhereFewPointsLieAtPlanes) {
  const FrontendConfig config = spinning_config();
  LocalMap map = map_of_rings(config, {15.0, 13.0});
  std::vector<Eigen::Vector3f> points;
  for (int k = 0; k < 600; ++k) points.push_back(on_floor(13.0, 0.01 * k).cast<float>());
  ScanMatcher matcher(config);
  EXPECT_GT(matcher.match({}, {}, points, map, {}).stats.matched, 400);

  std::vector<Eigen::Vector3f> wall;
  for (float x = -3.0F; x < 3.0F; x += 0.1F) {
    for (float y = 0.0F; y < 6.0F; y += 0.1F) wall.emplace_back(x, y, 4.0F);
  }
  map.insert(wall, {}, true);
  const int of_wall = matcher.match({}, {}, wall, map, {}).stats.matched;
  EXPECT_GT(of_wall, 1000);
  points.insert(points.end(), wall.begin(), wall.end());
  EXPECT_EQ(matcher.match({}, {}, points, map, {}).stats.matched, of_wall);
}

}  // namespace
}  // namespace ignis
