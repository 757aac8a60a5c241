// SPDX-License-Identifier: Apache-2.0
#include "frontend/planes/plane_jacobian.h"

#include <gtest/gtest.h>

#include <random>

#include "common/so3.h"

namespace ignis {
namespace {

TEST(PlaneJacobian, IsTheNumericalDerivativeOfTheDistance) {
  constexpr double kStep = 1e-6;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  for (int i = 0; i < 50; ++i) {
    const Eigen::Matrix3d R = so3::exp(vector()).toRotationMatrix();
    const Eigen::Vector3d t = vector();
    const Eigen::Vector3d point = 5.0 * vector();
    const Eigen::Vector3d plane_normal = vector().normalized();
    const auto distance = [&](const Vector6d& error) {
      const Eigen::Matrix3d turned = R * so3::exp(error.head<3>()).toRotationMatrix();
      return plane_normal.dot(turned * point + t + error.tail<3>());
    };
    Vector6d numerical;
    for (int k = 0; k < 6; ++k) {
      const Vector6d step = kStep * Vector6d::Unit(k);
      numerical[k] = (distance(step) - distance(-step)) / (2.0 * kStep);
    }
    EXPECT_LT((plane_jacobian(R, point, plane_normal) - numerical).norm(), 1e-7);
  }
}

}  // namespace
}  // namespace ignis
