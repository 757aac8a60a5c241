// SPDX-License-Identifier: Apache-2.0
#include "frontend/planes/scatter_axes.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include "common/so3.h"

namespace ignis {
namespace {

void expect_decomposes(const Eigen::Matrix3d& A, double tolerance) {
  const ScatterAxes axes = scatter_axes(A);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> oracle(A);
  const double scale = std::max(A.trace(), 1e-300);
  EXPECT_LT((axes.values - oracle.eigenvalues()).norm() / scale, tolerance) << A;
  EXPECT_LT((axes.vectors.transpose() * axes.vectors - Eigen::Matrix3d::Identity()).norm(), 1e-12) << A;
  const Eigen::Matrix3d again = axes.vectors * axes.values.asDiagonal() * axes.vectors.transpose();
  EXPECT_LT((again - A).norm() / scale, tolerance) << A;
}

Eigen::Matrix3d turned(const Eigen::Vector3d& values, const Eigen::Vector3d& rotation) {
  const Eigen::Matrix3d R = so3::exp(rotation).toRotationMatrix();
  return R * values.asDiagonal() * R.transpose();
}

TEST(ScatterAxes, EqualTheIterativeDecompositionForPlanesOfAnyShape) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-3.0, 3.0);
  std::uniform_real_distribution<double> exponent(-9.0, -1.0);
  for (int i = 0; i < 20'000; ++i) {
    const Eigen::Vector3d rotation(uniform(random), uniform(random), uniform(random));
    const double thickness = std::pow(10.0, exponent(random));
    const double width = 0.1 + 0.3 * std::abs(uniform(random));
    expect_decomposes(turned(1e-2 * Eigen::Vector3d(thickness * width, width, 1.0), rotation), 1e-12);
    if (HasFailure()) return;
  }
}

TEST(ScatterAxes, HoldForLinesBallsAndWhatIsExactlySingular) {
  const Eigen::Vector3d rotation(0.3, -1.2, 0.7);
  for (const Eigen::Vector3d& values :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 1, 1), Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(0, 1e-9, 1),
        Eigen::Vector3d(1e-12, 1e-9, 1), Eigen::Vector3d(0.999, 1, 1.001), Eigen::Vector3d(0.3, 0.3, 1)}) {
    // Where roots fall together a root of the polynomial is known to a power of the precision only.
    expect_decomposes(turned(values, rotation), 2e-5);
    expect_decomposes(values.asDiagonal().toDenseMatrix(), 2e-5);
    expect_decomposes(1e-8 * turned(values, rotation), 2e-5);
  }
}

TEST(ScatterAxes, OfNothingAreTheAxesOfTheFrame) {
  const ScatterAxes axes = scatter_axes(Eigen::Matrix3d::Zero());
  EXPECT_EQ(axes.values, Eigen::Vector3d::Zero());
  EXPECT_EQ(axes.vectors, Eigen::Matrix3d::Identity());
}

}  // namespace
}  // namespace ignis
