// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/solids.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace ignis::sim {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// The ray parameters at which the line is inside, and the outward local normals at both ends.
struct Span {
  double enter = -kInfinity;
  double leave = kInfinity;
  Eigen::Vector3d enter_normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d leave_normal = Eigen::Vector3d::Zero();

  [[nodiscard]] bool empty() const { return !(enter < leave); }
};

void clip_to_slab(Span& span, int axis, double origin, double direction, double half) {
  if (direction == 0.0) {
    if (std::abs(origin) > half) span.leave = -kInfinity;
    return;
  }
  const double inverse = 1.0 / direction;
  const double side = direction > 0.0 ? 1.0 : -1.0;
  const double near = (-side * half - origin) * inverse;
  const double far = (side * half - origin) * inverse;
  if (near > span.enter) {
    span.enter = near;
    span.enter_normal = -side * Eigen::Vector3d::Unit(axis);
  }
  if (far < span.leave) {
    span.leave = far;
    span.leave_normal = side * Eigen::Vector3d::Unit(axis);
  }
}

/// Clips to |w o + t d| <= radius, where w masks the axes that count (all three: sphere; X and Z: cylinder).
void clip_to_round(Span& span, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double radius) {
  const double a = direction.squaredNorm();
  const double b = origin.dot(direction);
  const double c = origin.squaredNorm() - radius * radius;
  if (a == 0.0) {
    if (c > 0.0) span.leave = -kInfinity;
    return;
  }
  const double discriminant = b * b - a * c;
  if (discriminant <= 0.0) {
    span.leave = -kInfinity;
    return;
  }
  const double root = std::sqrt(discriminant);
  const double near = (-b - root) / a;
  const double far = (-b + root) / a;
  if (near > span.enter) {
    span.enter = near;
    span.enter_normal = (origin + near * direction) / radius;
  }
  if (far < span.leave) {
    span.leave = far;
    span.leave_normal = (origin + far * direction) / radius;
  }
}

Span inside_span(const Solid& solid, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  Span span;
  switch (solid.shape) {
    case Solid::Shape::kBox:
      for (int axis = 0; axis < 3; ++axis) {
        clip_to_slab(span, axis, origin[axis], direction[axis], solid.half_extent[axis]);
      }
      break;
    case Solid::Shape::kCylinder:
      clip_to_slab(span, 1, origin.y(), direction.y(), solid.half_extent.y());
      clip_to_round(span, {origin.x(), 0.0, origin.z()}, {direction.x(), 0.0, direction.z()}, solid.half_extent.x());
      break;
    case Solid::Shape::kSphere:
      clip_to_round(span, origin, direction, solid.half_extent.x());
      break;
  }
  return span;
}

}  // namespace

std::optional<Hit> intersect(const Solid& solid, const Ray& ray, double limit) {
  const Eigen::Vector3d origin = solid.R_world_local.transpose() * (ray.origin - solid.center);
  const Eigen::Vector3d direction = solid.R_world_local.transpose() * ray.direction;
  const Span span = inside_span(solid, origin, direction);
  if (span.empty() || span.leave <= 0.0) return std::nullopt;
  const bool outside = span.enter > 0.0;
  const double distance = outside ? span.enter : span.leave;
  if (distance >= limit) return std::nullopt;
  const Eigen::Vector3d normal = outside ? span.enter_normal : span.leave_normal;
  return Hit{distance, solid.R_world_local * normal, solid.reflectivity};
}

std::optional<Hit> intersect(const Plane& plane, const Ray& ray, double limit) {
  const double approach = plane.normal.dot(ray.direction);
  if (approach == 0.0) return std::nullopt;
  const double distance = (plane.offset - plane.normal.dot(ray.origin)) / approach;
  if (distance <= 0.0 || distance >= limit) return std::nullopt;
  return Hit{distance, plane.normal, plane.reflectivity};
}

double signed_distance(const Solid& solid, const Eigen::Vector3d& point) {
  const Eigen::Vector3d local = solid.R_world_local.transpose() * (point - solid.center);
  if (solid.shape == Solid::Shape::kSphere) return local.norm() - solid.half_extent.x();
  Eigen::Vector3d beyond = local.cwiseAbs() - solid.half_extent;
  if (solid.shape == Solid::Shape::kCylinder) {
    beyond = {std::hypot(local.x(), local.z()) - solid.half_extent.x(), beyond.y(), -kInfinity};
  }
  return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

double signed_distance(const Plane& plane, const Eigen::Vector3d& point) {
  return plane.normal.dot(point) - plane.offset;
}

Eigen::AlignedBox3d bounds(const Solid& solid) {
  const Eigen::Vector3d reach = solid.R_world_local.cwiseAbs() * solid.half_extent;
  return {solid.center - reach, solid.center + reach};
}

}  // namespace ignis::sim
