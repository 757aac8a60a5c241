// SPDX-License-Identifier: Apache-2.0
#include "frontend/planes/plane_fit.h"

#include <gtest/gtest.h>

#include <random>

#include "common/so3.h"

namespace ignis {
namespace {

/// A 5x5 grid of points in the XY plane of a rotated frame, half width `half`, displaced by `shift` from the query.
NeighbourMoments grid(const Eigen::Quaterniond& q, double half, const Eigen::Vector3d& shift, double bump = 0.0,
                      double aspect = 1.0) {
  NeighbourMoments moments;
  for (int i = -2; i <= 2; ++i) {
    for (int j = -2; j <= 2; ++j) {
      const double sign = (i + j) % 2 == 0 ? 1.0 : -1.0;
      moments.add({.offset = q * (Eigen::Vector3d(0.5 * half * i, 0.5 * half * aspect * j, bump * sign) + shift)});
    }
  }
  return moments;
}

TEST(PlaneFit, FindsNormalAndDistanceOfATiltedPlane) {
  const FrontendConfig config;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-3.0, 3.0);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Vector3d phi(uniform(random), uniform(random), uniform(random));
    const Eigen::Quaterniond q = so3::exp(phi);
    const PlaneFit fit = fit_plane(grid(q, 0.4, {0.02, -0.03, 0.07}), config);
    ASSERT_EQ(fit.verdict, PlaneVerdict::kPlane);
    EXPECT_NEAR(std::abs(fit.normal.dot(q * Eigen::Vector3d::UnitZ())), 1.0, 1e-9);
    EXPECT_NEAR(std::abs(fit.normal.dot(fit.offset)), 0.07, 1e-9);
  }
}

TEST(PlaneFit, SigmaOfTheNormalMatchesSampledErrors) {
  FrontendConfig config;
  config.max_surface_roughness = 0.1;
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 0.01);
  Eigen::Matrix3d sampled = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d claimed = Eigen::Matrix3d::Zero();
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    NeighbourMoments moments;
    for (int i = -2; i <= 2; ++i) {
      for (int j = -2; j <= 2; ++j) moments.add({.offset = {0.2 * i, 0.1 * j, noise(random)}});
    }
    const PlaneFit fit = fit_plane(moments, config);
    ASSERT_EQ(fit.verdict, PlaneVerdict::kPlane);
    const Eigen::Vector3d error = fit.normal * (fit.normal.z() > 0.0 ? 1.0 : -1.0) - Eigen::Vector3d::UnitZ();
    sampled += error * error.transpose() / kTrials;
    claimed += fit.normal_sigma * fit.normal_sigma.transpose() / kTrials;
  }
  EXPECT_NEAR(claimed(0, 0) / sampled(0, 0), 1.0, 0.15);
  EXPECT_NEAR(claimed(1, 1) / sampled(1, 1), 1.0, 0.15);
}

TEST(PlaneFit, RefusesTooFewPoints) {
  NeighbourMoments moments;
  for (int i = 0; i < 4; ++i) moments.add({.offset = {0.1 * (i % 2), 0.1 * (i / 2), 0.0}});
  EXPECT_EQ(fit_plane(moments, {}).verdict, PlaneVerdict::kTooFewPoints);
}

TEST(PlaneFit, RefusesABlob) {
  NeighbourMoments moments;
  for (int i = 0; i < 27; ++i) moments.add({.offset = 0.1 * Eigen::Vector3d(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)});
  EXPECT_EQ(fit_plane(moments, {}).verdict, PlaneVerdict::kBlob);
}

TEST(PlaneFit, RefusesALine) {
  const NeighbourMoments moments = grid(Eigen::Quaterniond::Identity(), 0.4, Eigen::Vector3d::Zero(), 0.0, 0.1);
  EXPECT_EQ(fit_plane(moments, {}).verdict, PlaneVerdict::kLine);
}

// Four means, 12 cm long and 5 or 7 cm wide: a spread of 2.5 or 3.5 cm along the narrow side.
TEST(PlaneFit, RefusesALineThatNoiseHasWidened) {
  FrontendConfig config;
  config.min_plane_points = 4;
  config.max_curvature = 0.3;
  const auto verdict_at = [&](double width) {
    NeighbourMoments moments;
    for (const double along : {-0.06, 0.06}) {
      for (const double side : {-0.5, 0.5}) moments.add({.offset = {along, side * width, 0.02 * along * side}});
    }
    return fit_plane(moments, config).verdict;
  };
  EXPECT_EQ(verdict_at(0.05), PlaneVerdict::kPlane);
  config.min_plane_width_m = 0.03;
  EXPECT_EQ(verdict_at(0.05), PlaneVerdict::kLine);
  EXPECT_EQ(verdict_at(0.07), PlaneVerdict::kPlane);
}

TEST(PlaneFit, RefusesAOneSidedCluster) {
  const NeighbourMoments moments = grid(Eigen::Quaterniond::Identity(), 0.3, {0.15, 0.0, 0.0});
  EXPECT_EQ(fit_plane(moments, {}).verdict, PlaneVerdict::kOneSided);
}

TEST(PlaneFit, DoesNotCallADistantPlaneOneSided) {
  const NeighbourMoments moments = grid(Eigen::Quaterniond::Identity(), 0.3, {0.0, 0.0, 0.3});
  EXPECT_EQ(fit_plane(moments, {}).verdict, PlaneVerdict::kPlane);
}

TEST(PlaneFit, RefusesARoughSurface) {
  const auto verdict = [](double bump) {
    return fit_plane(grid(Eigen::Quaterniond::Identity(), 0.4, Eigen::Vector3d::Zero(), bump), {}).verdict;
  };
  EXPECT_EQ(verdict(0.03), PlaneVerdict::kRough);
  EXPECT_EQ(verdict(0.015), PlaneVerdict::kPlane);
}

}  // namespace
}  // namespace ignis
