// SPDX-License-Identifier: Apache-2.0
#include "frontend/degeneracy.h"

#include <gtest/gtest.h>

#include <random>

namespace ignis {
namespace {

struct Planes {
  Matrix6d sensitivity = Matrix6d::Zero();
  Matrix6d noise = Matrix6d::Zero();
};

Vector6d row(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
  Vector6d h;
  h << point.cross(normal), normal;
  return h;
}

/// Walls, floor and ceiling along Z whose fitted normals are off by `sigma` [rad], and `faces` points on surfaces that
/// really look along Z.
Planes corridor(double sigma, int faces, std::uint32_t seed) {
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
      const Vector6d error = row(point, sigma * tangent);
      planes.noise += error * error.transpose() / kPoints;
    }
    const double first = normal(random);
    const double second = normal(random);
    const Vector6d h = row(point, (n + first * tangents[0] + second * tangents[1]).normalized());
    planes.sensitivity += h * h.transpose() / kPoints;
  }
  return planes;
}

TEST(Degeneracy, WhatErrorsOfTheNormalsExplainIsNotAnObservation) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const Planes planes = corridor(0.03, 0, seed);
    const DegeneracyAnalysis blind = analyse_degeneracy(planes.sensitivity, Matrix6d::Zero(), {4.0, 1e-5, 1.6});
    EXPECT_EQ(blind.degenerate_directions, 0) << "without the noise nothing looks wrong";
    const DegeneracyAnalysis aware = analyse_degeneracy(planes.sensitivity, planes.noise, {4.0, 1e-5, 1.6});
    ASSERT_EQ(aware.degenerate_directions, 1) << seed;
    EXPECT_GT(std::abs(aware.degenerate[0][5]), 0.99) << "along the corridor";
  }
}

TEST(Degeneracy, AFewRealFacesMakeTheAxisObserved) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    const Planes planes = corridor(0.03, 12, seed);
    EXPECT_EQ(analyse_degeneracy(planes.sensitivity, planes.noise, {4.0, 1e-5, 1.6}).degenerate_directions, 0) << seed;
  }
}

TEST(Degeneracy, AWeakDirectionLosesTheShareThatIsNoise) {
  Matrix6d sensitivity = Matrix6d::Identity() / 3.0;
  Matrix6d noise = Matrix6d::Zero();
  noise(5, 5) = 1.0 / 15.0;
  const DegeneracyAnalysis analysis = analyse_degeneracy(sensitivity, noise, {1.0, 1e-5, 1.6});
  EXPECT_EQ(analysis.degenerate_directions, 0);
  const Matrix6d kept = analysis.projector.transpose() * sensitivity * analysis.projector;
  EXPECT_NEAR(kept(5, 5), 1.0 / 3.0 - 1.0 / 15.0, 1e-12);
  EXPECT_NEAR(kept(4, 4), 1.0 / 3.0, 1e-12);
}

TEST(Degeneracy, NamesADirectionByItsLargerPartAndWithoutASign) {
  DegeneracyAnalysis analysis;
  EXPECT_EQ(describe(analysis), "");
  analysis.degenerate = {-Vector6d::Unit(5), Vector6d::Unit(1)};
  EXPECT_EQ(describe(analysis), "position along odom (0.00, 0.00, 1.00); turn about body (0.00, 1.00, 0.00)");
}

}  // namespace
}  // namespace ignis
