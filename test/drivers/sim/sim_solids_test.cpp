// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/solids.h"

#include <random>

#include <gtest/gtest.h>

#include "common/so3.h"

namespace ignis::sim {
namespace {

constexpr double kFar = 50.0;
constexpr double kOnSurface = 1e-9;

class Randoms {
 public:
  explicit Randoms(unsigned seed) : engine_(seed) {}
  double in(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Eigen::Vector3d vector(double half) {
    const double x = in(-half, half);
    const double y = in(-half, half);
    return {x, y, in(-half, half)};
  }

 private:
  std::mt19937 engine_;
};

Solid random_solid(Solid::Shape shape, Randoms& random) {
  Solid solid;
  solid.shape = shape;
  solid.center = random.vector(2.0);
  solid.R_world_local = so3::exp(random.vector(2.0)).toRotationMatrix();
  const double a = random.in(0.3, 2.0);
  const double b = random.in(0.3, 2.0);
  const double c = random.in(0.3, 2.0);
  if (shape == Solid::Shape::kBox) solid.half_extent = {a, b, c};
  if (shape == Solid::Shape::kCylinder) solid.half_extent = {a, b, a};
  if (shape == Solid::Shape::kSphere) solid.half_extent = {a, a, a};
  return solid;
}

Ray random_ray(Randoms& random) {
  const Eigen::Vector3d origin = random.vector(6.0);
  return {origin, (random.vector(2.5) - origin).normalized()};
}

/// Oracle: steps along the ray by the signed distance, which can never jump over a surface.
std::optional<double> sphere_trace(const Solid& solid, const Ray& ray) {
  const double side = signed_distance(solid, ray.origin) > 0.0 ? 1.0 : -1.0;
  double t = 0.0;
  for (int step = 0; step < 20000 && t < kFar; ++step) {
    const double distance = side * signed_distance(solid, ray.origin + t * ray.direction);
    if (distance < 1e-7) return t;
    t += distance;
  }
  return std::nullopt;
}

class SolidShapes : public ::testing::TestWithParam<Solid::Shape> {};

TEST_P(SolidShapes, AgreeWithSphereTracingFromOutsideAndInside) {
  Randoms random(11);
  int hits = 0;
  int misses = 0;
  for (int i = 0; i < 3000; ++i) {
    const Solid solid = random_solid(GetParam(), random);
    const Ray ray = random_ray(random);
    const std::optional<Hit> hit = intersect(solid, ray, kFar);
    const std::optional<double> traced = sphere_trace(solid, ray);
    if (!hit) {
      // The oracle stops within 1e-7 of a surface, so it may call a near miss a hit.
      if (traced) {
        EXPECT_LT(signed_distance(solid, ray.origin + *traced * ray.direction), 1e-6);
      }
      ++misses;
      continue;
    }
    ++hits;
    ASSERT_TRUE(traced);
    const double slope = std::abs(hit->normal.dot(ray.direction));
    EXPECT_NEAR(hit->distance, *traced, 1e-6 / std::max(slope, 1e-3));
    EXPECT_NEAR(signed_distance(solid, ray.origin + hit->distance * ray.direction), 0.0, kOnSurface);
  }
  EXPECT_GT(hits, 400);
  EXPECT_GT(misses, 200);
}

TEST_P(SolidShapes, GiveTheOutwardNormalOfTheDistanceField) {
  Randoms random(12);
  for (int i = 0; i < 500; ++i) {
    const Solid solid = random_solid(GetParam(), random);
    const Ray ray = random_ray(random);
    const std::optional<Hit> hit = intersect(solid, ray, kFar);
    if (!hit) continue;
    const Eigen::Vector3d point = ray.origin + hit->distance * ray.direction;
    EXPECT_NEAR(hit->normal.norm(), 1.0, 1e-9);
    EXPECT_NEAR(signed_distance(solid, point + 1e-4 * hit->normal), 1e-4, 1e-8);
  }
}

TEST_P(SolidShapes, LieInsideTheirBounds) {
  Randoms random(13);
  for (int i = 0; i < 200; ++i) {
    const Solid solid = random_solid(GetParam(), random);
    const Eigen::AlignedBox3d box = bounds(solid);
    for (int k = 0; k < 50; ++k) {
      const Eigen::Vector3d point = solid.center + random.vector(3.5);
      if (signed_distance(solid, point) <= 0.0) {
        EXPECT_TRUE(box.contains(point));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, SolidShapes,
                         ::testing::Values(Solid::Shape::kBox, Solid::Shape::kCylinder, Solid::Shape::kSphere));

TEST(Solid, IsHitOnlyInFrontAndWithinTheLimit) {
  const Solid ball{Solid::Shape::kSphere, Eigen::Matrix3d::Identity(), {0, 0, -5}, {1, 1, 1}, 0.7};
  const Ray towards{Eigen::Vector3d::Zero(), {0, 0, -1}};
  ASSERT_TRUE(intersect(ball, towards, 10.0));
  EXPECT_DOUBLE_EQ(intersect(ball, towards, 10.0)->distance, 4.0);
  EXPECT_DOUBLE_EQ(intersect(ball, towards, 10.0)->reflectivity, 0.7);
  EXPECT_FALSE(intersect(ball, towards, 3.9));
  EXPECT_FALSE(intersect(ball, {Eigen::Vector3d::Zero(), {0, 0, 1}}, 10.0));
}

TEST(Solid, SurvivesRaysParallelToItsFaces) {
  const Solid box{Solid::Shape::kBox, Eigen::Matrix3d::Identity(), {0, 0, -5}, {1, 1, 1}, 0.5};
  const Solid post{Solid::Shape::kCylinder, Eigen::Matrix3d::Identity(), {0, 0, -5}, {1, 2, 1}, 0.5};
  EXPECT_TRUE(intersect(box, {{0.5, 0.5, 0}, {0, 0, -1}}, kFar));
  EXPECT_FALSE(intersect(box, {{1.5, 0.5, 0}, {0, 0, -1}}, kFar));
  EXPECT_DOUBLE_EQ(intersect(post, {{0, 9, -5}, {0, -1, 0}}, kFar)->distance, 7.0);
  EXPECT_FALSE(intersect(post, {{1.5, 9, -5}, {0, -1, 0}}, kFar));
}

TEST(Plane, IsHitAtTheAnalyticDistanceFromBothSides) {
  const Plane floor{Eigen::Vector3d::UnitY(), -1.0, 0.3};
  const Eigen::Vector3d down = Eigen::Vector3d(3, -4, 0).normalized();
  EXPECT_NEAR(intersect(floor, {{0, 3, 0}, down}, kFar)->distance, 5.0, 1e-12);
  EXPECT_NEAR(intersect(floor, {{0, -5, 0}, -down}, kFar)->distance, 5.0, 1e-12);
  EXPECT_FALSE(intersect(floor, {{0, 3, 0}, -down}, kFar));
  EXPECT_FALSE(intersect(floor, {{0, 3, 0}, {1, 0, 0}}, kFar));
  EXPECT_DOUBLE_EQ(signed_distance(floor, {7, 3, 7}), 4.0);
}

}  // namespace
}  // namespace ignis::sim
