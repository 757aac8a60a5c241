// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/mesh.h"

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "common/so3.h"
#include "drivers/sim/ray_scene.h"

namespace ignis::sim {
namespace {

constexpr double kFar = 50.0;

class Randoms {
 public:
  explicit Randoms(unsigned seed) : engine_(seed) {}
  Eigen::Vector3d vector(double half) {
    std::uniform_real_distribution<double> uniform(-half, half);
    const double x = uniform(engine_);
    const double y = uniform(engine_);
    return {x, y, uniform(engine_)};
  }
  Ray ray_towards(double half) {
    const Eigen::Vector3d origin = vector(6.0);
    return {origin, (vector(half) - origin).normalized()};
  }

 private:
  std::mt19937 engine_;
};

/// The twelve triangles of a box.
TriangleMesh mesh_of(const Solid& box) {
  TriangleMesh mesh{.reflectivity = box.reflectivity};
  for (unsigned corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign((corner & 1U) != 0 ? 1 : -1, (corner & 2U) != 0 ? 1 : -1, (corner & 4U) != 0 ? 1 : -1);
    mesh.vertices.push_back((box.center + box.R_world_local * sign.cwiseProduct(box.half_extent)).cast<float>());
  }
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return mesh;
}

/// A sphere of `rings` rings of twice as many corners.
TriangleMesh sphere_mesh(unsigned rings, double radius) {
  TriangleMesh mesh;
  for (unsigned i = 0; i <= rings; ++i) {
    const double polar = std::numbers::pi * i / rings;
    for (unsigned k = 0; k < 2 * rings; ++k) {
      const double around = std::numbers::pi * k / rings;
      const Eigen::Vector3d unit(std::sin(polar) * std::cos(around), std::cos(polar),
                                 std::sin(polar) * std::sin(around));
      mesh.vertices.push_back((radius * unit).cast<float>());
      if (i == rings) continue;
      const std::uint32_t a = i * 2 * rings + k;
      const std::uint32_t b = i * 2 * rings + (k + 1) % (2 * rings);
      mesh.triangles.push_back({a, b, a + 2 * rings});
      mesh.triangles.push_back({b, b + 2 * rings, a + 2 * rings});
    }
  }
  return mesh;
}

TEST(MeshScene, OfABoxEqualsTheAnalyticBoxRayByRay) {
  Randoms random(31);
  int hits = 0;
  for (int i = 0; i < 50; ++i) {
    const Solid box{Solid::Shape::kBox, so3::exp(random.vector(2.0)).toRotationMatrix(), random.vector(2.0),
                    Eigen::Vector3d::Constant(0.3) + random.vector(1.0).cwiseAbs(), 0.7};
    const RayScene scene({}, {}, {mesh_of(box)});
    for (int k = 0; k < 100; ++k) {
      const Ray ray = random.ray_towards(2.5);
      const std::optional<Hit> exact = intersect(box, ray, kFar);
      const std::optional<Hit> hit = scene.cast(ray, kFar);
      const double slope = exact ? std::abs(exact->normal.dot(ray.direction)) : 0.0;
      // Rounded corners move the faces by a micrometre; a grazing ray may pass the edge on either side.
      if (exact.has_value() != hit.has_value()) {
        const Solid larger{box.shape, box.R_world_local, box.center, box.half_extent.array() + 1e-5, 0.7};
        const Solid smaller{box.shape, box.R_world_local, box.center, box.half_extent.array() - 1e-5, 0.7};
        EXPECT_TRUE(intersect(larger, ray, kFar) && !intersect(smaller, ray, kFar));
        continue;
      }
      if (!hit || slope < 0.05) continue;
      ++hits;
      EXPECT_NEAR(hit->distance, exact->distance, 1e-5);
      EXPECT_NEAR(hit->normal.dot(exact->normal), 1.0, 1e-5) << "outward by the right-hand rule";
      EXPECT_DOUBLE_EQ(hit->reflectivity, 0.7);
    }
  }
  EXPECT_GT(hits, 500);
}

TEST(MeshScene, OfASphereConvergesToTheSphereWithTheSquareOfTheEdge) {
  constexpr double kRadius = 1.5;
  const Solid ball{Solid::Shape::kSphere, Eigen::Matrix3d::Identity(), {0, 0, 0}, {kRadius, kRadius, kRadius}, 0.5};
  std::vector<double> worst;
  for (const unsigned rings : {16U, 32U, 64U}) {
    const RayScene scene({}, {}, {sphere_mesh(rings, kRadius)});
    Randoms random(32);
    double largest = 0.0;
    for (int i = 0; i < 2000; ++i) {
      Ray ray = random.ray_towards(0.7);
      ray.origin += 5.0 * -ray.direction;
      const std::optional<Hit> hit = scene.cast(ray, kFar);
      ASSERT_TRUE(hit);
      largest = std::max(largest, std::abs(hit->distance - intersect(ball, ray, kFar)->distance));
    }
    worst.push_back(largest);
  }
  EXPECT_LT(worst[1], worst[0] / 3.0);
  EXPECT_LT(worst[2], worst[1] / 3.0);
  EXPECT_LT(worst[2], 4e-3);
}

TEST(MeshScene, ClearanceIsTheDistanceToTheNearestTriangle) {
  Randoms random(33);
  const Solid box{Solid::Shape::kBox, so3::exp({0.3, 0.5, -0.2}).toRotationMatrix(), {1, 2, 3}, {0.5, 1, 2}, 0.5};
  const RayScene scene({}, {}, {mesh_of(box)});
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d point = random.vector(6.0);
    EXPECT_NEAR(scene.clearance(point), std::abs(signed_distance(box, point)), 1e-5);
  }
}

TEST(MeshScene, TakesTheNearestOfSolidsMeshesAndPlanes) {
  const Solid wall{Solid::Shape::kBox, Eigen::Matrix3d::Identity(), {0, 0, -6}, {2, 2, 0.1}, 0.3};
  const Solid screen{Solid::Shape::kBox, Eigen::Matrix3d::Identity(), {0, 0, -4}, {1, 1, 0.1}, 0.9};
  const RayScene screen_before_wall({{Eigen::Vector3d::UnitY(), -1.5, 0.2}}, {wall}, {mesh_of(screen)});
  const RayScene wall_behind_mesh({}, {screen}, {mesh_of(wall)});
  for (const RayScene* scene : {&screen_before_wall, &wall_behind_mesh}) {
    const Ray ahead{Eigen::Vector3d::Zero(), {0, 0, -1}};
    ASSERT_TRUE(scene->cast(ahead, kFar));
    EXPECT_NEAR(scene->cast(ahead, kFar)->distance, 3.9, 1e-5);
    EXPECT_DOUBLE_EQ(scene->cast(ahead, kFar)->reflectivity, 0.9);
    EXPECT_NEAR(scene->cast({{1.5, 0, 0}, {0, 0, -1}}, kFar)->distance, 5.9, 1e-5);
    EXPECT_FALSE(scene->cast(ahead, 3.8));
    EXPECT_NEAR(scene->clearance({0, 0, -3}), 0.9, 1e-5);
  }
  EXPECT_NEAR(screen_before_wall.cast({Eigen::Vector3d::Zero(), {0, -1, 0}}, kFar)->distance, 1.5, 1e-12);
}

TEST(MeshScene, GivesTheSameHitsEachTime) {
  const TriangleMesh ball = sphere_mesh(24, 2.0);
  const RayScene first({}, {}, {ball});
  const RayScene second({}, {}, {ball});
  Randoms random(34);
  for (int i = 0; i < 5000; ++i) {
    const Ray ray = random.ray_towards(2.0);
    const std::optional<Hit> a = first.cast(ray, kFar);
    const std::optional<Hit> b = second.cast(ray, kFar);
    ASSERT_EQ(a.has_value(), b.has_value());
    if (a) {
      ASSERT_EQ(a->distance, b->distance);
    }
  }
}

/// Oracle: the nearest of many points of the triangle.
double sampled_distance(const std::array<Eigen::Vector3d, 3>& corners, const Eigen::Vector3d& point) {
  constexpr int kSteps = 120;
  double nearest = 1e9;
  for (int i = 0; i <= kSteps; ++i) {
    for (int k = 0; i + k <= kSteps; ++k) {
      const double u = static_cast<double>(i) / kSteps;
      const double v = static_cast<double>(k) / kSteps;
      nearest = std::min(nearest, (corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v - point).norm());
    }
  }
  return nearest;
}

TEST(TriangleMesh, DistanceAgreesWithSamplingTheTriangle) {
  Randoms random(35);
  for (int i = 0; i < 300; ++i) {
    const std::array<Eigen::Vector3d, 3> corners{random.vector(1.0), random.vector(1.0), random.vector(1.0)};
    TriangleMesh mesh{.triangles = {{0, 1, 2}}};
    for (const Eigen::Vector3d& corner : corners) mesh.vertices.push_back(corner.cast<float>());
    const Eigen::Vector3d point = random.vector(2.0);
    const double sampled = sampled_distance(corners, point);
    const double distance = distance_to(mesh, 0, point);
    EXPECT_LE(distance, sampled + 1e-6);
    // Half the longest step of the sampling grid, where the point lies on the triangle.
    EXPECT_GE(distance, sampled - 0.02);
  }
}

}  // namespace
}  // namespace ignis::sim
