// SPDX-License-Identifier: Apache-2.0
#include "frontend/local_map/neighbour_search.h"

#include <algorithm>

#include "frontend/local_map/local_map_walk.h"
#include "frontend/planes/row_sums.h"

namespace ignis {

std::span<const FourMoments> NeighbourSearch::gather(const LocalMap& map, std::span<const Eigen::Vector3d> queries,
                                                     double radius, std::span<const Eigen::Vector3d> sides) {
  moments_.clear();
  for (; !queries.empty(); queries = queries.subspan(std::min(kTogether, queries.size()))) {
    const std::span<const Eigen::Vector3d> together = queries.first(std::min(kTogether, queries.size()));
    find_blocks(map, together, radius);
    find_rows(map, together);
    if (sides.empty()) {
      add_rows<Sides::kAny>(together.size(), radius, sides);
    } else {
      add_rows<Sides::kOne>(together.size(), radius, sides);
      sides = sides.subspan(together.size());
    }
  }
  return moments_;
}

void NeighbourSearch::find_blocks(const LocalMap& map, std::span<const Eigen::Vector3d> queries, double radius) {
  blocks_.clear();
  for (std::size_t i = 0; i < queries.size(); ++i) {
    boxes_[i] = map.box_around(queries[i], radius);
    map.for_each_block(boxes_[i], [&](const LocalMap::Block& block) {
      __builtin_prefetch(&block.coordinate);  // in one line with the bits of what is confirmed
      blocks_.push_back({&block, i});
    });
  }
}

void NeighbourSearch::find_rows(const LocalMap& map, std::span<const Eigen::Vector3d> queries) {
  std::size_t found = 0;
  row_ends_.fill(0);
  for (const auto& [block, query] : blocks_) {
    if (rows_.size() < found + kRowsOfBlock) rows_.resize(2 * (found + kRowsOfBlock));
    const Eigen::Vector3f local = map.relative_to(*block, queries[query]);
    LocalMap::for_each_row(*block, boxes_[query], [&](const LocalMap::Row& row, std::uint32_t lanes) {
      __builtin_prefetch(&row.x);
      __builtin_prefetch(&row.scan);
      rows_[found++] = {&row, lanes, local};
    });
    row_ends_[query] = found;
  }
}

template <Sides kSides>
void NeighbourSearch::add_rows(std::size_t queries, double radius, std::span<const Eigen::Vector3d> sides) {
  std::size_t next = 0;
  for (std::size_t first = 0; first < queries; first += kLanes) {
    std::array<RowSums<kSides>, kLanes> four;
    for (std::size_t i = first; i < std::min(first + kLanes, queries); ++i) {
      RowSums<kSides> sums(radius);
      if constexpr (kSides == Sides::kOne) sums = RowSums<kSides>(radius, sides[i].template cast<float>());
      for (; next < row_ends_[i]; ++next) sums.add(*rows_[next].row, rows_[next].lanes, rows_[next].query);
      four[i - first] = sums;
    }
    moments_.push_back(RowSums<kSides>::moments(four));
  }
}

}  // namespace ignis
