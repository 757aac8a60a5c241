// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/plane_disagreement.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <limits>
#include <random>
#include <vector>

#include "frontend/planes/plane_jacobian.h"

namespace ignis {
namespace {

constexpr double kNoise = 0.02;  // m, sigma of a distance
constexpr int kPoints = 600;

/// The walls, floor and ceiling of a room about the sensor, one point each.
std::vector<Vector6d> jacobians_of_a_room(std::mt19937& random) {
  std::uniform_real_distribution<double> along(-5.0, 5.0);
  std::vector<Vector6d> jacobians;
  for (int i = 0; i < kPoints; ++i) {
    const int axis = i % 3;
    Eigen::Vector3d point(along(random), along(random), along(random));
    point[axis] = i % 2 == 0 ? 5.0 : -5.0;
    jacobians.push_back(plane_jacobian(Eigen::Matrix3d::Identity(), point, Eigen::Vector3d::Unit(axis)));
  }
  return jacobians;
}

/// What is left of distances once the pose is corrected by them, as the matcher corrects it.
Matrix6d disagreement_of(const std::vector<Vector6d>& jacobians, const std::vector<double>& distances) {
  const double weight = 1.0 / (kNoise * kNoise);
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  for (std::size_t i = 0; i < jacobians.size(); ++i) {
    information += weight * jacobians[i] * jacobians[i].transpose();
    gradient += weight * distances[i] * jacobians[i];
  }
  const Vector6d step = information.ldlt().solve(gradient);
  Matrix6d scatter = Matrix6d::Zero();
  for (std::size_t i = 0; i < jacobians.size(); ++i) {
    const double left = distances[i] - jacobians[i].dot(step);
    scatter += weight * weight * left * left * jacobians[i] * jacobians[i].transpose();
  }
  return plane_disagreement(information, scatter);
}

std::vector<double> noisy_distances(std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, kNoise);
  std::vector<double> distances(kPoints);
  for (double& distance : distances) distance = noise(random);
  return distances;
}

double largest(const Matrix6d& covariance) {
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(covariance).eigenvalues()[5];
}

TEST(PlaneDisagreement, IsLittleOfWhatIsToldWhereDistancesAreNoise) {
  std::mt19937 random(1);
  const double told = kNoise * kNoise / (kPoints / 3.0);  // of a shift [m^2]
  for (int draw = 0; draw < 20; ++draw) {
    const std::vector<Vector6d> jacobians = jacobians_of_a_room(random);
    EXPECT_LT(largest(disagreement_of(jacobians, noisy_distances(random))), 0.4 * told);
  }
}

TEST(PlaneDisagreement, IsWhatTheSandwichSaysBeyondTheNoiseWhereTwoWallsContradictEachOther) {
  std::mt19937 random(2);
  const std::vector<Vector6d> jacobians = jacobians_of_a_room(random);
  std::vector<double> distances(kPoints, 0.0);
  constexpr double kApart = 0.05;  // m: the walls across X have come closer by twice that
  for (int i = 0; i < kPoints; i += 3) distances[i] = i % 2 == 0 ? kApart : -kApart;
  const Matrix6d disagreement = disagreement_of(jacobians, distances);
  // N points of the same weight along one axis: the sandwich is z^2 / N, the noise sigma^2 / N.
  const double expected = (kApart * kApart - kNoise * kNoise) / (kPoints / 3.0);
  EXPECT_NEAR(disagreement(3, 3), expected, 0.05 * expected);
  EXPECT_LT(disagreement(4, 4), 0.02 * expected) << "the others agree";
  EXPECT_LT(disagreement(5, 5), 0.02 * expected);
}

TEST(PlaneDisagreement, IsACovarianceWhateverThePointsSay) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 200; ++i) {
    Matrix6d information = Matrix6d::Zero();
    Matrix6d scatter = Matrix6d::Zero();
    for (int point = 0; point < 1 + i % 9; ++point) {  // fewer than six leave directions open
      const Vector6d h = Vector6d::NullaryExpr([&] { return normal(random); });
      information += h * h.transpose();
      scatter += 100.0 * normal(random) * normal(random) * h * h.transpose();
      scatter = 0.5 * (scatter + scatter.transpose()).eval();
    }
    const Matrix6d disagreement = plane_disagreement(information, scatter);
    ASSERT_TRUE(disagreement.allFinite());
    EXPECT_LT(disagreement.norm(), 1e10) << "what rounding leaves along an open direction is not divided by";
    EXPECT_LT((disagreement - disagreement.transpose()).norm(), 1e-9 * (1.0 + disagreement.norm()));
    const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(disagreement);
    EXPECT_GT(solver.eigenvalues()[0], -1e-9 * (1.0 + disagreement.norm()));
  }
  EXPECT_EQ(plane_disagreement(Matrix6d::Zero(), Matrix6d::Zero()), Matrix6d::Zero());
  const Matrix6d no_number = Matrix6d::Constant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(plane_disagreement(Matrix6d::Identity(), no_number), Matrix6d::Zero());
}

}  // namespace
}  // namespace ignis
