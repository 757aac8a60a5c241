// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstdint>

namespace ignis {

/// Index of a cubic cell: cell i spans [i, i + 1) * cell size on each axis of the world.
struct CellIndex {
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t z = 0;
  auto operator<=>(const CellIndex&) const = default;
};

/// The cell of a grid `ratio` times coarser that contains `cell` (rounds down, also below zero).
[[nodiscard]] CellIndex parent_cell(const CellIndex& cell, int ratio);

}  // namespace ignis
