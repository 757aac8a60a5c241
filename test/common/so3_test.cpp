// SPDX-License-Identifier: Apache-2.0
#include "common/so3.h"

#include <random>

#include <gtest/gtest.h>
#include <unsupported/Eigen/MatrixFunctions>

namespace ignis {
namespace {

// Closed forms against Eigen's general matrix functions: exact to rounding.
constexpr double kRounding = 1e-14;

std::vector<Eigen::Vector3d> rotation_vectors() {
  std::vector<Eigen::Vector3d> vectors = {Eigen::Vector3d::Zero(), {1e-9, 0, 0},
                                          {0, -1e-5, 1e-5},        {9.9e-5, 0, 0},
                                          {1.1e-4, 0, 0},          {0, 3.1, 0},
                                          {0.0, 0.004, 0.001},     {0.0999, 0, 0},
                                          {0, 0, 0.1001},          {1.5707963267948966, 0.0, 0.0},
                                          {-0.3, 0.2, -0.9}};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1.7, 1.7);
  for (int i = 0; i < 50; ++i) vectors.emplace_back(uniform(random), uniform(random), uniform(random));
  return vectors;
}

TEST(So3, ExpEqualsMatrixExponentialOfSkew) {
  for (const Eigen::Vector3d& phi : rotation_vectors()) {
    const Eigen::Matrix3d expected = so3::skew(phi).exp();
    EXPECT_LT((so3::exp(phi).toRotationMatrix() - expected).norm(), kRounding) << phi.transpose();
  }
}

TEST(So3, LogInvertsExpUpToAngleOfPi) {
  for (const Eigen::Vector3d& phi : rotation_vectors()) {
    EXPECT_LT((so3::log(so3::exp(phi)) - phi).norm(), 1e-10) << phi.transpose();
  }
}

TEST(So3, LogTakesTheShortWayForNegatedQuaternions) {
  const Eigen::Quaterniond q = so3::exp({0.1, -0.2, 0.3});
  const Eigen::Quaterniond negated(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_LT((so3::log(negated) - so3::log(q)).norm(), kRounding);
}

TEST(So3, RightJacobianEqualsNumericalDerivative) {
  constexpr double kStep = 1e-6;
  for (const Eigen::Vector3d& phi : rotation_vectors()) {
    Eigen::Matrix3d numerical;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d plus = so3::log(so3::exp(phi).conjugate() * so3::exp(phi + step));
      const Eigen::Vector3d minus = so3::log(so3::exp(phi).conjugate() * so3::exp(phi - step));
      numerical.col(axis) = (plus - minus) / (2.0 * kStep);
    }
    EXPECT_LT((so3::right_jacobian(phi) - numerical).norm(), 1e-7) << phi.transpose();
  }
}

TEST(So3, RightJacobianInverseIsTheInverse) {
  for (const Eigen::Vector3d& phi : rotation_vectors()) {
    const Eigen::Matrix3d product = so3::right_jacobian(phi) * so3::right_jacobian_inverse(phi);
    EXPECT_LT((product - Eigen::Matrix3d::Identity()).norm(), 1e-8) << phi.transpose();
  }
}

TEST(So3, RotatingALittleEqualsTheExponential) {
  for (const double angle : {0.0, 1e-9, 1e-3, 0.1, 0.3, 0.5}) {
    const Eigen::Vector3d phi = angle * Eigen::Vector3d(0.6, -0.64, 0.48);
    const Eigen::Vector3d point(3.0, -20.0, 50.0);
    EXPECT_LT((so3::rotate_a_little(phi, point) - so3::exp(phi) * point).norm(), 1e-10 * point.norm()) << angle;
  }
}

}  // namespace
}  // namespace ignis
