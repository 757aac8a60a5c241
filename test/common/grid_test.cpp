// SPDX-License-Identifier: Apache-2.0
#include "common/grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace ignis {
namespace {

TEST(Grid, FloorsLikeTheStandardLibrary) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1e6, 1e6);
  for (int i = 0; i < 100'000; ++i) {
    const double value = uniform(random);
    ASSERT_EQ(floor_to_int(value), static_cast<int>(std::floor(value))) << value;
    const auto single = static_cast<float>(value);
    ASSERT_EQ(floor_to_int(single), static_cast<int>(std::floor(single))) << single;
  }
  for (const double value : {-2.0, -1.0, -0.0, 0.0, 1.0, -1e-300, 1e-300, -0.5, 2.5, -2147483648.0, 2147483647.0}) {
    EXPECT_EQ(floor_to_int(value), static_cast<int>(std::floor(value))) << value;
  }
}

TEST(Grid, CellsMeetAtWholeNumbers) {
  EXPECT_EQ(cell_of(Eigen::Vector3d(-0.1, 0.0, 0.9)), Eigen::Vector3i(-1, 0, 0));
  EXPECT_EQ(cell_of(Eigen::Vector3f(-1.0F, 1.0F, -1.1F)), Eigen::Vector3i(-1, 1, -2));
}

}  // namespace
}  // namespace ignis
