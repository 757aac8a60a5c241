// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/voxel_index.h"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <random>

namespace ignis {
namespace {

TEST(VoxelIndex, NumbersCellsAndVisitsNeighboursAsAPlainMapDoes) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> place(-9, 9);
  const auto any_cell = [&] { return Eigen::Vector3i::NullaryExpr([&] { return place(random); }).eval(); };
  VoxelIndex index;
  std::map<std::array<int, 3>, std::uint32_t> plain;
  for (int i = 0; i < 1500; ++i) {
    const Eigen::Vector3i cell = any_cell();
    const auto known = plain.try_emplace({cell.x(), cell.y(), cell.z()}, static_cast<std::uint32_t>(plain.size()));
    ASSERT_EQ(index.enter(cell), known.first->second);
  }
  EXPECT_EQ(index.size(), plain.size());
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3i centre = any_cell();
    for (int reach = 0; reach <= VoxelIndex::kLargestReach; ++reach) {
      std::vector<std::uint32_t> expected;
      for (const auto& [cell, number] : plain) {  // in the order of x, y, z
        if ((Eigen::Vector3i(cell[0], cell[1], cell[2]) - centre).cwiseAbs().maxCoeff() <= reach) {
          expected.push_back(number);
        }
      }
      std::vector<std::uint32_t> visited;
      index.for_each_around(centre, reach, [&](std::uint32_t number) { visited.push_back(number); });
      EXPECT_EQ(visited, expected);
    }
    const auto known = plain.find({centre.x(), centre.y(), centre.z()});
    EXPECT_EQ(index.find(centre), known == plain.end() ? std::nullopt : std::optional(known->second));
  }
}

}  // namespace
}  // namespace ignis
