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

inline constexpr int kKeyBits = 21;
inline constexpr CellKey kKeyMask = (1ULL << kKeyBits) - 1;
inline constexpr std::int32_t kKeyBias = 1 << (kKeyBits - 1);

[[nodiscard]] constexpr CellKey pack(const CellIndex& cell) {
  const auto axis = [](std::int32_t index) { return static_cast<CellKey>(index + kKeyBias) & kKeyMask; };
  return axis(cell.x) << (2 * kKeyBits) | axis(cell.y) << kKeyBits | axis(cell.z);
}

[[nodiscard]] constexpr CellIndex unpack(CellKey key) {
  const auto axis = [](CellKey bits) { return static_cast<std::int32_t>(bits & kKeyMask) - kKeyBias; };
  return {axis(key >> (2 * kKeyBits)), axis(key >> kKeyBits), axis(key)};
}

}  // namespace ignis
