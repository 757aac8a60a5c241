// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace ignis {

/// Takes elements out of a vector by their indices, ascending; what lies beyond its end is not there. Those behind move
/// up.
template <class Element>
void erase_places(std::vector<Element>& elements, std::span<const std::size_t> places) {
  std::size_t kept = 0;
  auto gone = places.begin();
  for (std::size_t i = 0; i < elements.size(); ++i) {
    if (gone != places.end() && *gone == i) {
      ++gone;
      continue;
    }
    if (kept != i) elements[kept] = std::move(elements[i]);
    ++kept;
  }
  elements.erase(elements.begin() + static_cast<std::ptrdiff_t>(kept), elements.end());
}

}  // namespace ignis
