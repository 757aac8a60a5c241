// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <random>

#include "common/pose.h"

/// What plane fits in a corridor say about a pose, without a corridor.
namespace ignis::test {

struct Planes {
  Matrix6d sensitivity = Matrix6d::Zero();
  Matrix6d noise = Matrix6d::Zero();
};

inline Vector6d plane_row(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  Vector6d h;
  h << point.cross(normal), normal;
  return h;
}

/// Walls, floor and ceiling along Z whose fitted normals are off by `sigma` [rad], and `faces` points on surfaces that
/// really look along Z.
inline Planes corridor_planes(double sigma, int faces, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, sigma);
  std::uniform_real_distribution<double> along(-8.0, 8.0);
  std::uniform_real_distribution<double> across(-1.4, 1.4);
  constexpr int kPoints = 800;
  Planes planes;
  for (int i = 0; i < kPoints; ++i) {
    const bool wall = i % 2 == 0;
    const double side = i % 4 < 2 ? -1.5 : 1.5;
    Eigen::Vector3d point(wall ? side : across(random), wall ? across(random) : side, along(random));
    Eigen::Vector3d n = wall ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    if (i < faces) n = Eigen::Vector3d::UnitZ();
    const std::array<Eigen::Vector3d, 2> tangents = {n.cross(Eigen::Vector3d(1, 1, 1)).normalized(),
                                                     n.cross(n.cross(Eigen::Vector3d(1, 1, 1))).normalized()};
    for (const Eigen::Vector3d& tangent : tangents) {
      const Vector6d error = plane_row(point, sigma * tangent);
      planes.noise += error * error.transpose() / kPoints;
    }
    const double first = normal(random);
    const double second = normal(random);
    const Vector6d h = plane_row(point, (n + first * tangents[0] + second * tangents[1]).normalized());
    planes.sensitivity += h * h.transpose() / kPoints;
  }
  return planes;
}

}  // namespace ignis::test
