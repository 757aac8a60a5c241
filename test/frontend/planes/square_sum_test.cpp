// SPDX-License-Identifier: Apache-2.0
#include "frontend/planes/square_sum.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace ignis {
namespace {

TEST(SquareSum, IsToTheBitTheSumOfTheWholeProducts) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  SquareSum sum;
  Matrix6d whole = Matrix6d::Zero();
  for (int i = 0; i < 1000; ++i) {
    const Vector6d h = Vector6d::NullaryExpr([&] { return normal(random); });
    sum.add(h);
    whole += h * h.transpose();
  }
  EXPECT_EQ(sum.matrix(), whole);
}

TEST(SquareSum, CountsEachByItsWeight) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  SquareSum sum;
  Matrix6d whole = Matrix6d::Zero();
  for (int i = 0; i < 1000; ++i) {
    const Vector6d h = Vector6d::NullaryExpr([&] { return normal(random); });
    const double weight = std::abs(normal(random));
    sum.add(h, weight);
    whole += weight * h * h.transpose();
  }
  EXPECT_LT((sum.matrix() - whole).norm(), 1e-12 * whole.norm());
}

}  // namespace
}  // namespace ignis
