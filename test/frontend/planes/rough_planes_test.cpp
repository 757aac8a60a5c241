// SPDX-License-Identifier: Apache-2.0
#include "frontend/planes/rough_planes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <random>

namespace ignis {
namespace {

constexpr double kNoise = 0.02;  // m, of a measured point
const Eigen::Vector3d kAlong = -Eigen::Vector3d::UnitZ();
const Eigen::Vector3d kAcross = Eigen::Vector3d::UnitX();
const Eigen::Vector3d kUp = Eigen::Vector3d::UnitY();

/// Mean over many planes of three by three voxels, of one to nine points each, of the variance of a point that would
/// explain how rough they are, less the true one [m^2]. `step`: by how much the middle row is higher [m].
double mean_excess(double step) {
  FrontendConfig config;
  config.max_curvature = 1.0;
  config.max_surface_roughness = 1.0;
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, kNoise);
  std::uniform_int_distribution<int> points(1, 9);
  double sum = 0.0;
  constexpr int kPlanes = 4000;
  for (int plane = 0; plane < kPlanes; ++plane) {
    NeighbourMoments moments;
    for (int i = -1; i <= 1; ++i) {
      for (int k = -1; k <= 1; ++k) {
        const int count = points(random);
        const double height = (i == 0 ? step : 0.0) + noise(random) / std::sqrt(count);
        moments.add({.offset = {0.1 * i, height, 0.1 * k}, .weight = static_cast<double>(count)});
      }
    }
    const PlaneFit fit = fit_plane(moments, config, 0.2);
    // What is unexplained is never negative, so its mean would be too large without any step.
    double low = 0.0;
    double high = 1.0;
    for (int halving = 0; halving < 40; ++halving) {
      const double middle = 0.5 * (low + high);
      (unexplained_variance(fit, middle) > 0.0 ? low : high) = middle;
    }
    sum += low * low;
  }
  return sum / kPlanes - kNoise * kNoise;
}

TEST(UnexplainedVariance, IsNoneWhereNoiseOfThePointsIsAll) {
  EXPECT_NEAR(mean_excess(0.0), 0.0, 0.04 * kNoise * kNoise);
  EXPECT_GT(mean_excess(0.03), kNoise * kNoise);
}

TEST(UnexplainedVariance, IsTheWholeOneWhereNoiseIsUnknown) {
  PlaneFit fit;
  fit.count = 9;
  fit.points = 9.0;
  fit.scatter = {1e-4, 1e-2, 1e-2};
  EXPECT_DOUBLE_EQ(unexplained_variance(fit, 0.0), 1e-4);
}

constexpr double kEnough = 6.0;  // planes

double sufficiency_of(int along, int across, double smoothness = 1.0) {
  SmoothSupport support;
  const double strict = strict_smoothness(smoothness);
  for (int i = 0; i < along; ++i) support.add(kAlong, strict);
  for (int i = 0; i < across; ++i) support.add(kAcross, strict);
  for (int i = 0; i < 200; ++i) support.add(kUp, strict);
  return support.sufficiency(kEnough);
}

TEST(StrictSmoothness, IsNextToNothingOfARoughPlanesAndAllOfASmoothOnes) {
  EXPECT_LT(strict_smoothness(0.3), 0.01);
  EXPECT_DOUBLE_EQ(strict_smoothness(1.0), 1.0);
}

TEST(SmoothSupport, IsNoneWhereNothingFacesTheWay) {
  EXPECT_LT(sufficiency_of(0, 200), 1e-9);
  EXPECT_LT(sufficiency_of(1, 200), 0.001);
}

TEST(SmoothSupport, IsHalfWhereTheWeakestDirectionIsHeldByEnough) { EXPECT_NEAR(sufficiency_of(6, 200), 0.5, 1e-9); }

TEST(SmoothSupport, IsWholeWhereAllDirectionsAreHeld) { EXPECT_GT(sufficiency_of(200, 200), 0.999); }

TEST(SmoothSupport, IsNotOfRoughPlanes) { EXPECT_LT(sufficiency_of(200, 200, 0.2), 0.01); }

TEST(SmoothSupport, AsksForTheWeakestDirectionHoweverItLies) {
  const Eigen::Matrix3d turned =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, 2.0, -0.5).normalized()).toRotationMatrix();
  SmoothSupport support;
  for (int i = 0; i < 200'000; ++i) support.add(turned * kUp, 1.0);
  for (int i = 0; i < 200'000; ++i) support.add(turned * kAcross, 1.0);
  EXPECT_LT(support.sufficiency(kEnough), 1e-6);
  for (int i = 0; i < 6; ++i) support.add(turned * kAlong, 1.0);
  EXPECT_NEAR(support.sufficiency(kEnough), 0.5, 1e-3);
}

}  // namespace
}  // namespace ignis
