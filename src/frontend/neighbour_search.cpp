// SPDX-License-Identifier: Apache-2.0
#include "frontend/neighbour_search.h"

#include <algorithm>

#include "frontend/local_map_walk.h"
#include "frontend/row_sums.h"

namespace ignis {

std::span<const NeighbourMoments> NeighbourSearch::gather(const LocalMap& map, std::span<const Eigen::Vector3d> queries,
                                                          double radius, std::span<const Eigen::Vector3d> sides) {
  moments_.clear();
  for (; !queries.empty(); queries = queries.subspan(std::min(kTogether, queries.size()))) {
    const std::span<const Eigen::Vector3d> together = queries.first(std::min(kTogether, queries.size()));
    find_blocks(map, together, radius);
    find_rows(map, together);
    add_rows(together.size(), radius, sides);
    sides = sides.subspan(std::min(together.size(), sides.size()));
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
  rows_.clear();
  row_ends_.fill(0);
  for (const auto& [block, query] : blocks_) {
    const Eigen::Vector3f local = map.relative_to(*block, queries[query]);
    LocalMap::for_each_row(*block, boxes_[query], [&](const LocalMap::Row& row, std::uint32_t lanes) {
      __builtin_prefetch(&row.x);
      __builtin_prefetch(&row.scan);
      rows_.push_back({&row, lanes, local});
    });
    row_ends_[query] = rows_.size();
  }
}

void NeighbourSearch::add_rows(std::size_t queries, double radius, std::span<const Eigen::Vector3d> sides) {
  std::size_t next = 0;
  const auto add = [&](std::size_t query, auto sums) {
    for (; next < row_ends_[query]; ++next) sums.add(*rows_[next].row, rows_[next].lanes, rows_[next].query);
    moments_.push_back(sums.moments());
  };
  for (std::size_t i = 0; i < queries; ++i) {
    if (sides.empty()) {
      add(i, RowSums<Sides::kAny>(radius));
    } else {
      add(i, RowSums<Sides::kOne>(radius, sides[i].cast<float>()));
    }
  }
}

}  // namespace ignis
