// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <boost/unordered/unordered_flat_map.hpp>

#include "map/tile_grid.h"
#include "map/voxel.h"

namespace ignis {

/// A set of levels, one bit each.
using LevelSet = std::uint8_t;
[[nodiscard]] constexpr LevelSet only(std::size_t level) { return static_cast<LevelSet>(1U << level); }
[[nodiscard]] constexpr bool has(LevelSet set, std::size_t level) { return (set >> level & 1U) != 0; }
inline constexpr LevelSet kAllLevels = 0b111;

/// A cube of the world: its voxels on the levels that the map holds there, and which clouds have points in it.
class Tile {
 public:
  using Level = boost::unordered_flat_map<std::uint32_t, Voxel>;  // by cell within the tile

  explicit Tile(const CellIndex& index) : index_(index) {}

  /// Offers a point to the cell of one level. Returns whether the cell was empty (+1 voxel).
  bool insert(std::size_t level, std::uint32_t cell_in_tile, const Voxel& voxel, std::uint64_t stamp) {
    const auto [found, is_new] = levels_[level].try_emplace(cell_in_tile, voxel);
    if (!is_new) {
      if (!stands_before(voxel, found->second)) return false;
      found->second = voxel;
    }
    version_ = stamp;
    return is_new;
  }

  /// Forgets the voxels of some levels and their memory; returns how many there were.
  std::size_t clear(LevelSet levels);

  [[nodiscard]] const CellIndex& index() const { return index_; }
  [[nodiscard]] const Level& level(std::size_t level) const { return levels_[level]; }
  [[nodiscard]] std::size_t bytes() const;

  LevelSet held = 0;                 ///< levels whose window reaches into this tile
  LevelSet refilling = 0;            ///< levels that are being filled from the clouds
  std::vector<std::int32_t> clouds;  ///< keyframes with points here, each once

  /// Of each mid cell, how many keyframes found it free; empty as long as none did.
  std::vector<std::uint16_t> votes;

  /// Changes whenever what the tile shows may have changed.
  [[nodiscard]] std::uint64_t version() const { return version_; }
  void touch(std::uint64_t stamp) { version_ = stamp; }

 private:
  CellIndex index_;
  std::array<Level, kLevels> levels_;
  std::uint64_t version_ = 0;
};

}  // namespace ignis
