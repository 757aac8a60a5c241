// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/plane_finder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace ignis {
namespace {

constexpr double kHeight = 1.8;  // m, of a LiDAR above the floor

/// Of config/spinning.json.
FrontendConfig spinning_config(double line_radius) {
  FrontendConfig config;
  config.match_radius_m = 0.3;
  config.wide_match_radius_m = 0.6;
  config.line_match_radius_m = line_radius;
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

std::vector<PlaneFit> planes_along(double below_deg, const std::vector<double>& rings, double line_radius) {
  const FrontendConfig config = spinning_config(line_radius);
  const LocalMap map = map_of_rings(config, rings);
  PlaneFinder finder(config);
  std::vector<Eigen::Vector3d> queries;
  for (int k = 0; k < 60; ++k) queries.push_back(on_floor(below_deg, 0.1 * k));
  const auto found = finder.find(map, queries, Eigen::Vector3d::Zero());
  return {found.begin(), found.end()};
}

TEST(PlaneFinder, FindsTheFloorBetweenTwoRingsThatAreALineEach) {
  for (const PlaneFit& plane : planes_along(13.0, {15.0, 13.0}, 0.0)) EXPECT_NE(plane.verdict, PlaneVerdict::kPlane);
  int found = 0;
  for (const PlaneFit& plane : planes_along(13.0, {15.0, 13.0}, 1.5)) {
    if (plane.verdict != PlaneVerdict::kPlane) continue;
    ++found;
    EXPECT_GT(std::abs(plane.normal.y()), std::cos(0.02));
    EXPECT_NEAR(plane.normal.dot(plane.offset), 0.0, 0.01);
  }
  EXPECT_GT(found, 40);
}

TEST(PlaneFinder, TakesOneRingForALineHoweverFarItLooks) {
  for (const PlaneFit& plane : planes_along(13.0, {13.0}, 1.5)) EXPECT_EQ(plane.verdict, PlaneVerdict::kLine);
}

}  // namespace
}  // namespace ignis
