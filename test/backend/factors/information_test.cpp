// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/information.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace ignis {
namespace {

Matrix6d random_positive_definite(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Matrix6d A;
  for (double& v : A.reshaped()) v = normal(random);
  return A * A.transpose() + 0.1 * Matrix6d::Identity();
}

TEST(Information, WhiteningIsASquareRoot) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Matrix6d L = random_positive_definite(seed);
    const WhiteningRows W = whitening(L);
    EXPECT_EQ(W.rows(), 6);
    EXPECT_LT((W.transpose() * W - L).norm(), 1e-9 * L.norm());
  }
}

TEST(Information, WhiteningDropsDirectionsWithoutKnowledgeAndNegativeOnes) {
  Vector6d diagonal;
  diagonal << 100.0, 0.0, 4.0, -1e-3, 9.0, 1.0;
  const WhiteningRows W = whitening(diagonal.asDiagonal());
  EXPECT_EQ(W.rows(), 4);
  const Matrix6d back = W.transpose() * W;
  const Matrix6d expected = diagonal.cwiseMax(0.0).asDiagonal();
  EXPECT_LT((back - expected).norm(), 1e-12);
}

TEST(Information, FloorAddsAnIndependentError) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Matrix6d L = 1e4 * random_positive_definite(seed);
    Vector6d floor;
    floor << Eigen::Vector3d::Constant(0.01 * 0.01), Eigen::Vector3d::Constant(0.05 * 0.05);
    const Matrix6d expected = (L.inverse() + Matrix6d(floor.asDiagonal())).inverse();
    const WhiteningRows W = whitening_with_floor(L, 0.01, 0.05);
    EXPECT_LT((W.transpose() * W - expected).norm(), 1e-9 * expected.norm());
  }
}

TEST(Information, FloorLeavesAFreeDirectionFree) {
  Vector6d diagonal = Vector6d::Constant(1e4);
  diagonal(5) = 0.0;
  const WhiteningRows W = whitening_with_floor(diagonal.asDiagonal(), 0.01, 0.01);
  EXPECT_EQ(W.rows(), 5);
  EXPECT_LT((W * Vector6d::Unit(5)).norm(), 1e-12);
  EXPECT_EQ(whitening_with_floor(Matrix6d::Zero(), 0.01, 0.01).rows(), 0);
}

}  // namespace
}  // namespace ignis
