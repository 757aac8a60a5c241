// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
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

/// Adds one of `count` points [m, body axes] on a plane whose normal is fitted with an error of `sigma` [rad].
inline void add_point(Planes& planes, const Eigen::Vector3d& point, const Eigen::Vector3d& n, double sigma, int count,
                      std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, sigma);
  const std::array<Eigen::Vector3d, 2> tangents = {n.cross(Eigen::Vector3d(1, 1, 1)).normalized(),
                                                   n.cross(n.cross(Eigen::Vector3d(1, 1, 1))).normalized()};
  for (const Eigen::Vector3d& tangent : tangents) {
    const Vector6d error = plane_row(point, sigma * tangent);
    planes.noise += error * error.transpose() / count;
  }
  const double first = normal(random);
  const double second = normal(random);
  const Vector6d h = plane_row(point, (n + first * tangents[0] + second * tangents[1]).normalized());
  planes.sensitivity += h * h.transpose() / count;
}

/// Walls, floor and ceiling along Z whose fitted normals are off by `sigma` [rad], and `faces` points on surfaces that
/// really look along Z.
inline Planes corridor_planes(double sigma, int faces, std::uint32_t seed) {
  std::mt19937 random(seed);
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
    add_point(planes, point, n, sigma, kPoints, random);
  }
  return planes;
}

/// Walls, floor and ceiling of a corridor that bends about an upright axis `radius` [m] to the left, as a vehicle in
/// its middle sees them that looks along -Z: as far as the inner wall lets it.
inline Planes bend_planes(double radius, double sigma, std::uint32_t seed) {
  std::mt19937 random(seed);
  const double inner = std::acos((radius - 1.4) / radius);
  const double outer = inner + std::acos((radius - 1.4) / (radius + 1.4));
  std::uniform_real_distribution<double> ahead(-1.0, 1.0);
  std::uniform_real_distribution<double> across(-1.4, 1.4);
  constexpr int kPoints = 800;
  const Eigen::Vector3d axis(-radius, 0.0, 0.0);
  Planes planes;
  for (int i = 0; i < kPoints; ++i) {
    const bool wall = i % 2 == 0;
    const double side = i % 4 < 2 ? -1.4 : 1.4;
    const double angle = ahead(random) * (wall && side > 0.0 ? outer : inner);
    const Eigen::Vector3d outward(std::cos(angle), 0.0, std::sin(angle));
    const double from_axis = radius + (wall ? side : across(random));
    const double up = wall ? across(random) : side;
    const Eigen::Vector3d point = axis + from_axis * outward + up * Eigen::Vector3d::UnitY();
    add_point(planes, point, wall ? outward : Eigen::Vector3d::UnitY(), sigma, kPoints, random);
  }
  return planes;
}

/// The wall, floor and ceiling of a round tank of 6 m radius about the odom Y axis, as a vehicle at a pose sees them.
inline Planes tank_planes(const Pose& T_odom_body, double sigma, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> around(-std::numbers::pi, std::numbers::pi);
  std::uniform_real_distribution<double> up(-1.5, 1.5);
  constexpr double kRadius = 6.0;
  constexpr int kPoints = 800;
  const Pose T_body_odom = T_odom_body.inverse();
  Planes planes;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = around(random);
    const Eigen::Vector3d outward(std::cos(angle), 0.0, std::sin(angle));
    const bool wall = i % 2 == 0;
    const Eigen::Vector3d point = wall ? Eigen::Vector3d(kRadius * outward + up(random) * Eigen::Vector3d::UnitY())
                                       : Eigen::Vector3d(3.0 * outward + 1.5 * Eigen::Vector3d::UnitY());
    const Eigen::Vector3d n = wall ? outward : Eigen::Vector3d::UnitY();
    add_point(planes, T_body_odom * point, T_body_odom.rotation * n, sigma, kPoints, random);
  }
  // Rows are in body axes so far; position is in odom axes.
  Matrix6d to_odom = Matrix6d::Identity();
  to_odom.bottomRightCorner<3, 3>() = T_odom_body.rotation.toRotationMatrix();
  planes.sensitivity = (to_odom * planes.sensitivity * to_odom.transpose()).eval();
  planes.noise = (to_odom * planes.noise * to_odom.transpose()).eval();
  return planes;
}

}  // namespace ignis::test
