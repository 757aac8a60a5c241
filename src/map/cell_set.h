// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include <boost/unordered/unordered_flat_map.hpp>

#include "map/cell_index.h"

namespace ignis {

/// A set of cells that surfaces pass through: one bit each in blocks of 4x4x4, so that the neighbours of a cell, which
/// a scan asks for next, share its entry in the table, and the table fits into the cache.
class CellSet {
 public:
  CellSet() = default;
  CellSet(const CellSet&) = delete;  // it points into itself
  CellSet& operator=(const CellSet&) = delete;

  /// False when the cell was there already.
  bool insert(const CellIndex& cell) {
    std::uint64_t& block = block_of({cell.x >> kEdgeBits, cell.y >> kEdgeBits, cell.z >> kEdgeBits});
    const std::uint64_t flag = std::uint64_t{1} << bit_of(cell);
    const bool is_new = (block & flag) == 0;
    block |= flag;
    return is_new;
  }

  void clear() {
    blocks_.clear();
    newest_ = nullptr;
  }

  [[nodiscard]] std::size_t bytes() const { return blocks_.bucket_count() * (sizeof(Blocks::value_type) + 1); }

 private:
  using Blocks = boost::unordered_flat_map<CellKey, std::uint64_t>;

  static constexpr int kEdgeBits = 2;

  [[nodiscard]] static int bit_of(const CellIndex& cell) {
    return (cell.x & 3) | (cell.y & 3) << kEdgeBits | (cell.z & 3) << (2 * kEdgeBits);
  }

  /// A scan stays in a block for some points before it goes on to the next.
  [[nodiscard]] std::uint64_t& block_of(const CellIndex& index) {
    const CellKey key = pack(index);
    if (newest_ == nullptr || key != newest_key_) {
      newest_ = &blocks_[key];
      newest_key_ = key;
    }
    return *newest_;
  }

  Blocks blocks_;
  CellKey newest_key_ = 0;
  std::uint64_t* newest_ = nullptr;  ///< of newest_key_; only a new block can move it, and becomes the newest
};

}  // namespace ignis
