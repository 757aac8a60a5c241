// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <boost/unordered/unordered_flat_map.hpp>

#include "map/cell_index.h"

namespace ignis {

/// A cell that rays passed through and nothing was hit near: its index from the keyframe, in 11, 10 and 11 bits.
using FreeCell = std::uint32_t;

[[nodiscard]] CellIndex unpack_free_cell(FreeCell cell);

/// Which cells around a keyframe its rays have found empty. The grid stands in the keyframe's body frame, so what was
/// seen stays right when the keyframe moves.
class FreeSpace {
 public:
  /// A cell is free when at least `min_rays` rays passed through it, and none of the scans hit it or one of its 26
  /// neighbours.
  FreeSpace(double cell_m, int min_rays) : cell_m_(cell_m), min_rays_(min_rays) {}

  /// One ray from the origin to what it hit, both in the keyframe's frame [m].
  void add_ray(const Eigen::Vector3d& origin, const Eigen::Vector3d& hit);

  /// Something that was hit by a ray from nobody knows where.
  void add_hit(const Eigen::Vector3d& hit);

  /// The free cells in ascending order; forgets everything.
  [[nodiscard]] std::vector<FreeCell> take();

  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Cell {
    std::uint16_t rays = 0;
    bool hit = false;
  };
  using Cells = boost::unordered_flat_map<CellKey, Cell>;

  [[nodiscard]] bool is_near_a_hit(const CellIndex& cell) const;

  double cell_m_;
  int min_rays_;
  Cells cells_;
};

}  // namespace ignis
