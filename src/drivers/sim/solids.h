// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

/// The solids of a scene, each with closed-form ray intersection and signed distance. World frame, metres.
///
/// A ray meets the surface: one that starts inside a solid sees the far side from within. Box: slab method (Kay and
/// Kajiya, SIGGRAPH 1986). Cylinder and sphere: quadratic in the ray parameter. Distances: exact Euclidean.
namespace ignis::sim {

struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();       ///< [m]
  Eigen::Vector3d direction = -Eigen::Vector3d::UnitZ();  ///< unit length
};

struct Hit {
  double distance = 0.0;                              ///< [m] along the ray
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  ///< unit length, outward from the solid
  double reflectivity = 0.0;                          ///< of the material, 0..1
};

struct Solid {
  enum class Shape { kBox, kCylinder, kSphere };

  Shape shape = Shape::kBox;
  Eigen::Matrix3d R_world_local = Eigen::Matrix3d::Identity();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();       ///< [m]
  Eigen::Vector3d half_extent = Eigen::Vector3d::Ones();  ///< [m] box: half sizes. Cylinder (axis local Y): radius,
                                                          ///< half length, radius. Sphere: the radius three times
  double reflectivity = 0.5;
};

/// Points p with normal . p = offset; the solid side is below.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  ///< unit length
  double offset = 0.0;                                ///< [m]
  double reflectivity = 0.5;
};

/// Nearest hit with 0 < distance < limit.
[[nodiscard]] std::optional<Hit> intersect(const Solid& solid, const Ray& ray, double limit);
[[nodiscard]] std::optional<Hit> intersect(const Plane& plane, const Ray& ray, double limit);

/// Distance from a point to the surface [m], negative inside.
[[nodiscard]] double signed_distance(const Solid& solid, const Eigen::Vector3d& point);
[[nodiscard]] double signed_distance(const Plane& plane, const Eigen::Vector3d& point);

/// Axis-parallel box around a solid.
[[nodiscard]] Eigen::AlignedBox3d bounds(const Solid& solid);

}  // namespace ignis::sim
