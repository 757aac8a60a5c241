// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cassert>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <boost/unordered/unordered_flat_map.hpp>

namespace ignis {

/// A cell as one number, for hash tables. Coordinates from -2^20 to 2^20 - 1 are told apart.
[[nodiscard]] inline std::uint64_t key_of(const Eigen::Vector3i& cell) {
  constexpr std::uint64_t kMask = (1U << 21U) - 1U;
  const auto part = [](int v) { return static_cast<std::uint64_t>(static_cast<std::int64_t>(v)) & kMask; };
  return (part(cell.x()) << 42U) | (part(cell.y()) << 21U) | part(cell.z());
}

/// Numbers the cells of a grid from 0 in the order in which they are entered. Cells live in blocks of 4x4x4 with one
/// bit of occupancy each, so that a neighbourhood, most of which is empty, costs one to eight probes of a hash table
/// and not one for each of its cells.
class VoxelIndex {
 public:
  /// A neighbourhood reaches no farther than this: so it meets at most two blocks along each axis.
  static constexpr int kLargestReach = 2;

  /// The number of a cell, which is size() before the call where the cell is new.
  std::uint32_t enter(const Eigen::Vector3i& cell) {
    const auto next = static_cast<std::uint32_t>(blocks_.size());
    const auto [place, is_new] = places_.try_emplace(key_of(block_of(cell)), next);
    if (is_new) blocks_.emplace_back();
    Block& block = blocks_[place->second];
    const int bit = bit_of(cell);
    if (!block.holds(bit)) {
      block.occupied |= std::uint64_t{1} << bit;
      block.numbers[bit] = size_++;
    }
    return block.numbers[bit];
  }

  [[nodiscard]] std::optional<std::uint32_t> find(const Eigen::Vector3i& cell) const {
    const Block* const block = find_block(block_of(cell));
    const int bit = bit_of(cell);
    if (block == nullptr || !block->holds(bit)) return std::nullopt;
    return block->numbers[bit];
  }

  /// Calls visit(number) for the cells entered within `reach` of `centre` along each axis, itself among them, in the
  /// order of x, then y, then z.
  template <class Visit>
  void for_each_around(const Eigen::Vector3i& centre, int reach, Visit visit) const {
    assert(reach >= 0 && reach <= kLargestReach);
    const Eigen::Vector3i lo = centre.array() - reach;
    const Eigen::Vector3i hi = centre.array() + reach;
    const Eigen::Vector3i first = block_of(lo);
    const Eigen::Vector3i last = block_of(hi);
    const Block* blocks[2][2][2] = {};
    for (int x = first.x(); x <= last.x(); ++x) {
      for (int y = first.y(); y <= last.y(); ++y) {
        for (int z = first.z(); z <= last.z(); ++z) {
          blocks[x - first.x()][y - first.y()][z - first.z()] = find_block({x, y, z});
        }
      }
    }
    for (int x = lo.x(); x <= hi.x(); ++x) {
      for (int y = lo.y(); y <= hi.y(); ++y) {
        const auto& row = blocks[(x >> kEdgeBits) - first.x()][(y >> kEdgeBits) - first.y()];
        for (int z = lo.z(); z <= hi.z(); ++z) {
          const Block* const block = row[(z >> kEdgeBits) - first.z()];
          const int bit = bit_of({x, y, z});
          if (block != nullptr && block->holds(bit)) visit(block->numbers[bit]);
        }
      }
    }
  }

  [[nodiscard]] std::uint32_t size() const { return size_; }

 private:
  static constexpr int kEdgeBits = 2;

  struct Block {
    std::uint64_t occupied = 0;
    std::uint32_t numbers[64];  ///< of the occupied ones

    [[nodiscard]] bool holds(int bit) const { return (occupied >> bit & 1U) != 0; }
  };

  [[nodiscard]] static Eigen::Vector3i block_of(const Eigen::Vector3i& cell) {
    return {cell.x() >> kEdgeBits, cell.y() >> kEdgeBits, cell.z() >> kEdgeBits};
  }
  [[nodiscard]] static int bit_of(const Eigen::Vector3i& cell) {
    return (cell.x() & 3) << (2 * kEdgeBits) | (cell.y() & 3) << kEdgeBits | (cell.z() & 3);
  }
  [[nodiscard]] const Block* find_block(const Eigen::Vector3i& block) const {
    const auto found = places_.find(key_of(block));
    return found == places_.end() ? nullptr : &blocks_[found->second];
  }

  std::vector<Block> blocks_;
  boost::unordered_flat_map<std::uint64_t, std::uint32_t> places_;  ///< in blocks_
  std::uint32_t size_ = 0;
};

}  // namespace ignis
