// SPDX-License-Identifier: Apache-2.0
#include "map/tile.h"

namespace ignis {

std::size_t Tile::clear(LevelSet levels) {
  std::size_t cleared = 0;
  for (std::size_t i = 0; i < kLevels; ++i) {
    if (!has(levels, i)) continue;
    cleared += levels_[i].size();
    levels_[i] = Level();
  }
  return cleared;
}

std::size_t Tile::bytes() const {
  std::size_t bytes =
      sizeof(Tile) + clouds.capacity() * sizeof(std::int32_t) + votes.capacity() * sizeof(std::uint16_t);
  for (const Level& level : levels_) bytes += level.bucket_count() * (sizeof(Level::value_type) + 1);
  return bytes;
}

}  // namespace ignis
