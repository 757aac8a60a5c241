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

/// A cell index as one number, for hash tables. Indices from -2^20 to 2^20 - 1 are told apart.
using CellKey = std::uint64_t;

[[nodiscard]] constexpr CellKey pack(const CellIndex& cell) {
  constexpr int kBits = 21;
  constexpr CellKey kMask = (1ULL << kBits) - 1;
  constexpr std::int32_t kBias = 1 << (kBits - 1);
  const auto axis = [](std::int32_t index) { return static_cast<CellKey>(index + kBias) & kMask; };
  return axis(cell.x) << (2 * kBits) | axis(cell.y) << kBits | axis(cell.z);
}

}  // namespace ignis
