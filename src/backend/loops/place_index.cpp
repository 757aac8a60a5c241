// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/place_index.h"

#include <algorithm>
#include <cmath>

namespace ignis {

std::int64_t PlaceIndex::line(double coordinate) const {
  return static_cast<std::int64_t>(std::floor(coordinate / cell_m_));
}

PlaceIndex::Cell PlaceIndex::cell(std::int64_t x, std::int64_t z) {
  return (static_cast<Cell>(x) << 32U) | (static_cast<Cell>(z) & 0xFFFF'FFFFU);
}

void PlaceIndex::place(std::size_t number, const Eigen::Vector3d& position) {
  const Cell now = cell(line(position.x()), line(position.z()));
  if (number == cell_of_.size()) {
    cell_of_.push_back(now);
  } else {
    Cell& before = cell_of_[number];
    if (before == now) return;
    std::erase(cells_[before], number);
    before = now;
  }
  cells_[now].push_back(number);
}

std::vector<std::size_t> PlaceIndex::around(const Eigen::Vector3d& position, double radius_m) const {
  std::vector<std::size_t> found;
  for (std::int64_t x = line(position.x() - radius_m); x <= line(position.x() + radius_m); ++x) {
    for (std::int64_t z = line(position.z() - radius_m); z <= line(position.z() + radius_m); ++z) {
      const auto here = cells_.find(cell(x, z));
      if (here != cells_.end()) found.insert(found.end(), here->second.begin(), here->second.end());
    }
  }
  std::ranges::sort(found);
  return found;
}

}  // namespace ignis
