// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/salient_points.h"

#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <random>

namespace ignis {
namespace {

constexpr double kNoise = 0.02;  // m
constexpr double kSigmas = 4.0;
const Eigen::Vector3d kAxis = Eigen::Vector3d::UnitZ();

FrontendConfig open_gates() {
  FrontendConfig config;
  config.min_plane_points = 4;
  config.max_curvature = 1.0;
  config.max_centroid_offset = 1.0;
  config.max_surface_roughness = 1.0;
  config.match_radius_m = 0.15;
  return config;
}

/// A wall patch of `count` points within 0.15 m, whose normal is the third of `axes`.
PlaneFit patch(const Eigen::Matrix3d& axes, int count, double noise, std::mt19937& random) {
  std::uniform_real_distribution<double> within(-0.1, 0.1);
  std::normal_distribution<double> across(0.0, noise);
  NeighbourMoments moments;
  for (int i = 0; i < count; ++i) {
    const double u = within(random);
    const double v = within(random);
    moments.add({.offset = axes * Eigen::Vector3d(u, v, across(random))});
  }
  return fit_plane(moments, open_gates());
}

/// Columns: two directions in the plane, and its normal, which is at `angle` to the axis.
Eigen::Matrix3d facing(double angle) { return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()).toRotationMatrix(); }

double salient_share(double angle, int count, std::uint32_t seed) {
  std::mt19937 random(seed);
  int salient = 0;
  int planes = 0;
  for (int trial = 0; trial < 5000; ++trial) {
    const PlaneFit plane = patch(facing(angle), count, kNoise, random);
    if (plane.verdict != PlaneVerdict::kPlane) continue;
    ++planes;
    salient += is_salient(plane, std::array{kAxis}, kNoise * kNoise, kSigmas) ? 1 : 0;
  }
  return static_cast<double>(salient) / planes;
}

TEST(SalientPoints, AnEndWallIsSalientAndTheWallsAlongTheAxisAreNot) {
  for (const int count : {10, 20}) {
    EXPECT_GT(salient_share(0.0, count, 1), 0.8) << count << " neighbours";
    EXPECT_LT(salient_share(0.5 * std::numbers::pi, count, 2), 0.01) << count << " neighbours";
  }
  EXPECT_LT(salient_share(0.5 * std::numbers::pi, 6, 3), 0.03) << "few neighbours, and still";
}

TEST(SalientPoints, APlaneThatLeansALittleIsNot) {
  EXPECT_LT(salient_share(0.5 * std::numbers::pi - 0.1, 40, 4), 0.005);
}

TEST(SalientPoints, FewNeighboursAreNot) {
  std::mt19937 random(5);
  const PlaneFit plane = patch(facing(0.0), 5, 1e-4, random);
  ASSERT_EQ(plane.verdict, PlaneVerdict::kPlane);
  EXPECT_FALSE(is_salient(plane, std::array{kAxis}, 1e-8, kSigmas));
}

TEST(SalientPoints, NeighboursThatHappenToLieWellAreJudgedByTheNoiseOfAll) {
  std::mt19937 random(6);
  const PlaneFit plane = patch(facing(1.1), 8, 1e-4, random);
  EXPECT_TRUE(is_salient(plane, std::array{kAxis}, 1e-8, kSigmas));
  EXPECT_FALSE(is_salient(plane, std::array{kAxis}, 0.03 * 0.03, kSigmas));
}

TEST(SalientPoints, AThickFitOverAnEdgeIsNot) {
  NeighbourMoments edge;  // wall and ceiling, that meet in a line along the axis
  for (int i = 0; i < 5; ++i) {
    for (int j = -1; j <= 1; ++j) {
      edge.add({.offset = {0.03 * i, 0.0, 0.03 * j}});
      edge.add({.offset = {0.0, 0.03 * i, 0.03 * j}});
    }
  }
  const PlaneFit plane = fit_plane(edge, open_gates());
  ASSERT_EQ(plane.verdict, PlaneVerdict::kPlane);
  EXPECT_FALSE(is_salient(plane, std::array<Eigen::Vector3d, 1>{plane.normal}, 1e-10, kSigmas));
}

TEST(SalientPoints, AnyOfSeveralAxesWillDoAndNoneIsNothing) {
  std::mt19937 random(7);
  const PlaneFit plane = patch(facing(0.0), 20, 0.002, random);
  const std::array<Eigen::Vector3d, 2> two{Eigen::Vector3d::UnitX(), -kAxis};
  EXPECT_TRUE(is_salient(plane, two, 1e-6, kSigmas));
  EXPECT_FALSE(is_salient(plane, {}, 1e-6, kSigmas));
}

}  // namespace
}  // namespace ignis
