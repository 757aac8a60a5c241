// SPDX-License-Identifier: Apache-2.0
#include "frontend/planes/four_planes.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "common/so3.h"

namespace ignis {
namespace {

FourMoments four_of(const std::array<NeighbourMoments, kLanes>& each) {
  FourMoments four;
  for (int k = 0; k < kLanes; ++k) {
    const NeighbourMoments& moments = each[static_cast<std::size_t>(k)];
    four.count[k] = static_cast<float>(moments.count);
    four.weight[k] = static_cast<float>(moments.weight);
    four.scan_sum[k] = static_cast<float>(moments.scan_sum);
    for (int i = 0, next = 0; i < 3; ++i) {
      four.sum[static_cast<std::size_t>(i)][k] = static_cast<float>(moments.sum[i]);
      four.view_sum[static_cast<std::size_t>(i)][k] = static_cast<float>(moments.view_sum[i]);
      for (int j = i; j < 3; ++j, ++next) {
        four.sum_outer[static_cast<std::size_t>(next)][k] = static_cast<float>(moments.sum_outer(i, j));
      }
    }
  }
  return four;
}

std::array<PlaneFit, kLanes> fits_of(const std::array<NeighbourMoments, kLanes>& each, const FrontendConfig& config,
                                     double radius) {
  std::array<PlaneFit, kLanes> fits;
  for (PlaneFit& fit : fits) fit.normal.setConstant(7.0);  // of another point, which must not be left
  const std::array<PlaneFit*, kLanes> places = {&fits[0], &fits[1], &fits[2], &fits[3]};
  fit_four_planes(four_of(each), config, radius, places);
  return fits;
}

/// Points of a slab of some size and thickness, turned and shifted at random.
class RandomNeighbourhoods {
 public:
  NeighbourMoments next() {
    const Eigen::Quaterniond q = so3::exp(3.0 * direction());
    const double thickness = std::pow(10.0, -3.5 + 2.7 * share_(random_));
    const double aspect = std::pow(10.0, -1.5 * share_(random_));
    const Eigen::Vector3d shift = 0.15 * direction();
    const Eigen::Vector3d seen_from = direction().normalized();
    NeighbourMoments moments;
    const int count = 2 + static_cast<int>(20.0 * share_(random_));
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d at = Eigen::Vector3d(0.1, 0.1 * aspect, thickness).cwiseProduct(direction());
      moments.add({.offset = q * at + shift,
                   .weight = std::floor(1.0 + 500.0 * share_(random_)),
                   .scan = std::floor(100.0 * share_(random_)),
                   .view = seen_from});
    }
    return moments;
  }

 private:
  Eigen::Vector3d direction() { return {signed_(random_), signed_(random_), signed_(random_)}; }

  std::mt19937 random_{3};
  std::uniform_real_distribution<double> share_{0.0, 1.0};
  std::uniform_real_distribution<double> signed_{-1.0, 1.0};
};

FrontendConfig gates() {
  FrontendConfig config;
  config.max_surface_roughness = 0.015;
  config.min_plane_width_m = 0.02;
  config.match_radius_m = 0.2;
  return config;
}

/// Whether no gate is so near that single precision may decide it the other way.
bool is_clear(const NeighbourMoments& moments, PlaneVerdict verdict, double radius) {
  for (const double factor : {0.998, 1.002}) {
    FrontendConfig config = gates();
    config.max_curvature *= factor;
    config.min_spread *= factor;
    config.min_plane_width_m *= factor;
    config.max_centroid_offset *= factor;
    config.max_surface_roughness *= factor;
    if (fit_plane(moments, config, radius).verdict != verdict) return false;
  }
  return true;
}

TEST(FourPlanes, EqualTheSingleFitOfEveryNeighbourhood) {
  const FrontendConfig config = gates();
  constexpr double kRadius = 0.2;
  RandomNeighbourhoods neighbourhoods;
  std::array<int, 6> seen{};
  int compared = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::array<NeighbourMoments, kLanes> each;
    for (NeighbourMoments& moments : each) moments = neighbourhoods.next();
    const std::array<PlaneFit, kLanes> fits = fits_of(each, config, kRadius);
    for (std::size_t k = 0; k < fits.size(); ++k) {
      const PlaneFit expected = fit_plane(each[k], config, kRadius);
      if (!is_clear(each[k], expected.verdict, kRadius)) continue;
      ++compared;
      ++seen[static_cast<std::size_t>(expected.verdict)];
      ASSERT_EQ(fits[k].verdict, expected.verdict) << expected.scatter.transpose();
      ASSERT_EQ(fits[k].count, expected.verdict == PlaneVerdict::kTooFewPoints ? 0 : expected.count);
      ASSERT_NEAR(fits[k].points, expected.points, 1e-6 * expected.points);
      if (expected.verdict != PlaneVerdict::kPlane) continue;
      const double sign = fits[k].normal.dot(expected.normal) > 0.0 ? 1.0 : -1.0;
      const double rounding = 1e-8 / expected.scatter[1];  // of the moments, which are those of offsets of 0.2 m
      ASSERT_LT((sign * fits[k].normal - expected.normal).norm(), 1e-6 + rounding);
      ASSERT_LT((fits[k].offset - expected.offset).norm(), 1e-6);
      ASSERT_LT((fits[k].scatter - expected.scatter).norm(), 1e-5 * expected.scatter[2]);
      ASSERT_NEAR(fits[k].mean_scan, expected.mean_scan, 1e-4);
      ASSERT_LT((fits[k].view - expected.view).norm(), 1e-5);
      // The two vectors are those in the plane, whose order and signs mean nothing where they are equal.
      const Eigen::Matrix3d spread = fits[k].normal_sigma * fits[k].normal_sigma.transpose();
      const Eigen::Matrix3d expected_spread = expected.normal_sigma * expected.normal_sigma.transpose();
      ASSERT_LT((spread - expected_spread).norm(), 2e-3 * expected_spread.norm() + rounding);
    }
  }
  EXPECT_GT(compared, 70'000);
  for (const int count : seen) EXPECT_GT(count, 100);
}

TEST(FourPlanes, SurviveLinesPointsAndBalls) {
  FrontendConfig config = gates();
  config.min_plane_points = 3;
  NeighbourMoments line;
  NeighbourMoments point;
  NeighbourMoments ball;
  for (int i = -2; i <= 2; ++i) line.add({.offset = 0.05 * i * Eigen::Vector3d(1.0, 2.0, -0.5)});
  for (int i = 0; i < 5; ++i) point.add({});
  for (int i = 0; i < 3; ++i) {
    ball.add({.offset = 0.1 * Eigen::Vector3d::Unit(i)});
    ball.add({.offset = -0.1 * Eigen::Vector3d::Unit(i)});
  }
  const std::array<PlaneFit, kLanes> fits = fits_of({line, point, ball, NeighbourMoments()}, config, 0.2);
  EXPECT_EQ(fits[0].verdict, PlaneVerdict::kLine);
  EXPECT_EQ(fits[1].verdict, PlaneVerdict::kBlob);
  EXPECT_EQ(fits[2].verdict, PlaneVerdict::kBlob);
  EXPECT_EQ(fits[3].verdict, PlaneVerdict::kTooFewPoints);
  EXPECT_EQ(fits[3].normal, Eigen::Vector3d::Zero());
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(fits[k].normal.norm(), 1.0, 1e-5) << k;
    EXPECT_TRUE(fits[k].scatter.allFinite() && fits[k].normal_sigma.allFinite()) << k;
  }
}

}  // namespace
}  // namespace ignis
