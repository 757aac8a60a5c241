// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <span>
#include <vector>

#include "frontend/local_map/local_map.h"
#include "frontend/planes/row_sums.h"

namespace ignis {

/// LocalMap::gather for the many queries of a scan. One by one they spend half of their time waiting for memory: first
/// for the head of a block, which says what rows there are, then for the rows. So some queries go together, and what
/// they all need is asked for before the first of them is worked on. Keeps its memory from scan to scan.
class NeighbourSearch {
 public:
  /// One lane for each query, four by four, the same to the bit as by LocalMap::gather; lanes beyond the last query
  /// have count 0. Valid until the next call. `sides`: one for each query, or none at all.
  [[nodiscard]] std::span<const FourMoments> gather(const LocalMap& map, std::span<const Eigen::Vector3d> queries,
                                                    double radius, std::span<const Eigen::Vector3d> sides = {});

 private:
  static constexpr std::size_t kTogether = 16;  // a whole number of kLanes

  static constexpr std::size_t kRowsOfBlock = LocalMap::kCells / LocalMap::kEdge;

  struct BlockVisit {
    const LocalMap::Block* block;
    std::size_t query;
  };
  struct RowVisit {
    const LocalMap::Row* row;
    std::uint32_t lanes;
    Eigen::Vector3f query;  ///< relative to the row's block [m]
  };

  void find_blocks(const LocalMap& map, std::span<const Eigen::Vector3d> queries, double radius);
  void find_rows(const LocalMap& map, std::span<const Eigen::Vector3d> queries);
  template <Sides kSides>
  void add_rows(std::size_t queries, double radius, std::span<const Eigen::Vector3d> sides);

  std::array<LocalMap::Box, kTogether> boxes_;
  std::array<std::size_t, kTogether> row_ends_;  ///< [query] end of its rows in rows_
  std::vector<BlockVisit> blocks_;
  std::vector<RowVisit> rows_;  ///< and room for more
  std::vector<FourMoments> moments_;
};

}  // namespace ignis
