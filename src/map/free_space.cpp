// SPDX-License-Identifier: Apache-2.0
#include "map/free_space.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/grid.h"

namespace ignis {
namespace {

constexpr std::int32_t kHalfWide = 1 << 10;  // x and z: 11 bits
constexpr std::int32_t kHalfHigh = 1 << 9;   // y: 10 bits

bool fits(const CellIndex& cell) {
  const auto within = [](std::int32_t index, std::int32_t half) { return index >= -half && index < half; };
  return within(cell.x, kHalfWide) && within(cell.y, kHalfHigh) && within(cell.z, kHalfWide);
}

FreeCell packed(const CellIndex& cell) {
  return static_cast<FreeCell>(cell.x + kHalfWide) << 21 | static_cast<FreeCell>(cell.y + kHalfHigh) << 11 |
         static_cast<FreeCell>(cell.z + kHalfWide);
}

CellIndex cell_at(const Eigen::Vector3d& p_in_cells) {
  return {floor_to_int(p_in_cells.x()), floor_to_int(p_in_cells.y()), floor_to_int(p_in_cells.z())};
}

/// Calls visit(cell) for the cells on the way from `from` to `to` (in cells), without the last one. Amanatides and Woo,
/// "A fast voxel traversal algorithm for ray tracing", 1987.
template <class Visit>
void traverse(const Eigen::Vector3d& from, const Eigen::Vector3d& to, Visit&& visit) {
  CellIndex cell = cell_at(from);
  const CellIndex last = cell_at(to);
  const Eigen::Vector3d way = to - from;
  std::int32_t* const index[] = {&cell.x, &cell.y, &cell.z};
  const std::int32_t end[] = {last.x, last.y, last.z};
  Eigen::Vector3d next;  // share of the way at which the next border of each axis is crossed
  Eigen::Vector3d step;
  for (int axis = 0; axis < 3; ++axis) {
    const bool still = way[axis] == 0.0;
    step[axis] = still ? std::numeric_limits<double>::infinity() : 1.0 / std::abs(way[axis]);
    const double border = static_cast<double>(*index[axis]) + (way[axis] > 0.0 ? 1.0 : 0.0);
    next[axis] = still ? step[axis] : std::abs(border - from[axis]) * step[axis];
  }
  // Rounding must not lead past the end: there are exactly this many borders between.
  int left = std::abs(end[0] - cell.x) + std::abs(end[1] - cell.y) + std::abs(end[2] - cell.z);
  while (left-- > 0) {
    visit(cell);
    int axis = 0;
    while (*index[axis] == end[axis]) ++axis;
    for (int other = axis + 1; other < 3; ++other) {
      if (*index[other] != end[other] && next[other] < next[axis]) axis = other;
    }
    *index[axis] += way[axis] > 0.0 ? 1 : -1;
    next[axis] += step[axis];
  }
}

}  // namespace

CellIndex unpack_free_cell(FreeCell cell) {
  return {static_cast<std::int32_t>(cell >> 21) - kHalfWide, static_cast<std::int32_t>(cell >> 11 & 0x3FF) - kHalfHigh,
          static_cast<std::int32_t>(cell & 0x7FF) - kHalfWide};
}

void FreeSpace::add_ray(const Eigen::Vector3d& origin, const Eigen::Vector3d& hit) {
  traverse(origin / cell_m_, hit / cell_m_, [this](const CellIndex& cell) {
    if (!fits(cell)) return;
    std::uint16_t& rays = cells_[pack(cell)].rays;
    if (rays < std::numeric_limits<std::uint16_t>::max()) ++rays;
  });
  add_hit(hit);
}

void FreeSpace::add_hit(const Eigen::Vector3d& hit) {
  const CellIndex cell = cell_at(hit / cell_m_);
  if (fits(cell)) cells_[pack(cell)].hit = true;
}

bool FreeSpace::is_near_a_hit(const CellIndex& cell) const {
  for (std::int32_t x = cell.x - 1; x <= cell.x + 1; ++x) {
    for (std::int32_t y = cell.y - 1; y <= cell.y + 1; ++y) {
      for (std::int32_t z = cell.z - 1; z <= cell.z + 1; ++z) {
        const auto found = cells_.find(pack({x, y, z}));
        if (found != cells_.end() && found->second.hit) return true;
      }
    }
  }
  return false;
}

std::vector<FreeCell> FreeSpace::take() {
  std::vector<FreeCell> free;
  for (const auto& [key, seen] : cells_) {
    const CellIndex cell = unpack(key);
    if (seen.rays >= min_rays_ && !is_near_a_hit(cell)) free.push_back(packed(cell));
  }
  std::ranges::sort(free);
  cells_ = Cells();
  return free;
}

std::size_t FreeSpace::bytes() const { return cells_.bucket_count() * (sizeof(Cells::value_type) + 1); }

}  // namespace ignis
