// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/ray_scene.h"

#include <random>

#include <gtest/gtest.h>

#include "common/so3.h"

namespace ignis::sim {
namespace {

RayScene crowded_scene(std::mt19937& engine, int solids) {
  std::uniform_real_distribution<double> place(-20.0, 20.0);
  std::uniform_real_distribution<double> size(0.1, 1.5);
  std::vector<Solid> list;
  for (int i = 0; i < solids; ++i) {
    Solid solid;
    solid.shape = static_cast<Solid::Shape>(i % 3);
    solid.center = {place(engine), place(engine), place(engine)};
    solid.half_extent = Eigen::Vector3d::Constant(size(engine));
    solid.R_world_local = so3::exp({place(engine), place(engine), place(engine)}).toRotationMatrix();
    list.push_back(solid);
  }
  return {{{Eigen::Vector3d::UnitY(), -15.0, 0.4}}, list};
}

TEST(RayScene, FindsTheSameHitAsTryingEverySolid) {
  std::mt19937 engine(21);
  std::normal_distribution<double> normal;
  for (const int count : {0, 1, 3, 4, 300}) {
    const RayScene scene = crowded_scene(engine, count);
    for (int i = 0; i < 2000; ++i) {
      const Ray ray{{normal(engine) * 5, normal(engine) * 5, normal(engine) * 5},
                    Eigen::Vector3d(normal(engine), normal(engine), normal(engine)).normalized()};
      std::optional<double> nearest;
      const auto consider = [&](const std::optional<Hit>& hit) {
        if (hit && (!nearest || hit->distance < *nearest)) nearest = hit->distance;
      };
      for (const Plane& plane : scene.planes()) consider(intersect(plane, ray, 30.0));
      for (const Solid& solid : scene.solids()) consider(intersect(solid, ray, 30.0));
      const std::optional<Hit> hit = scene.cast(ray, 30.0);
      ASSERT_EQ(hit.has_value(), nearest.has_value());
      if (hit) {
        EXPECT_DOUBLE_EQ(hit->distance, *nearest);
      }
    }
  }
}

TEST(RayScene, HandlesRaysAlongTheAxes) {
  const RayScene scene({}, {{Solid::Shape::kBox, Eigen::Matrix3d::Identity(), {0, 0, -5}, {1, 1, 1}, 0.5}});
  EXPECT_DOUBLE_EQ(scene.cast({{0, 0, 0}, {0, 0, -1}}, 20.0)->distance, 4.0);
  EXPECT_FALSE(scene.cast({{0, 0, 0}, {1, 0, 0}}, 20.0));
  EXPECT_FALSE(scene.cast({{0, 0, 0}, {0, 0, -1}}, 4.0));
}

TEST(RayScene, ClearanceIsTheDistanceToTheNearestSurface) {
  const RayScene scene({{Eigen::Vector3d::UnitY(), 0.0, 0.5}},
                       {{Solid::Shape::kSphere, Eigen::Matrix3d::Identity(), {5, 3, 0}, {1, 1, 1}, 0.5}});
  EXPECT_DOUBLE_EQ(scene.clearance({0, 0.5, 0}), 0.5);
  EXPECT_DOUBLE_EQ(scene.clearance({3, 3, 0}), 1.0);
  EXPECT_LT(scene.clearance({5, 3, 0}), 0.0);
}

}  // namespace
}  // namespace ignis::sim
