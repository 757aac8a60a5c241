// SPDX-License-Identifier: Apache-2.0
#include "map/cell_set.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace ignis {
namespace {

TEST(CellSet, TellsNewCellsFromKnownOnesAsAPlainSetDoes) {
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int32_t> place(-12, 12);
  CellSet cells;
  std::set<CellIndex> plain;
  for (int i = 0; i < 20'000; ++i) {
    if (i == 10'000) {
      cells.clear();
      plain.clear();
    }
    const CellIndex cell{place(random), place(random), place(random)};
    ASSERT_EQ(cells.insert(cell), plain.insert(cell).second) << i;
  }
  EXPECT_GT(cells.bytes(), plain.size() / 64 * 16);
}

}  // namespace
}  // namespace ignis
