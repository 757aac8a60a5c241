// SPDX-License-Identifier: Apache-2.0
#include "backend/journal/loop_list_change.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace ignis {

bool fits(const LoopListChange& change, const std::vector<GraphLoop>& loops) {
  const auto is_gone = [&](std::int32_t number) {
    return std::ranges::find(change.removed, number) != change.removed.end();
  };
  const auto is_there = [&](std::int32_t number) {
    return std::ranges::find(loops, number, &GraphLoop::number) != loops.end();
  };
  return std::ranges::all_of(change.removed, is_there) &&
         std::ranges::all_of(change.altered,
                             [&](const GraphLoop& loop) { return is_there(loop.number) && !is_gone(loop.number); });
}

void apply_to(std::vector<GraphLoop>& loops, LoopListChange change) {
  for (const std::int32_t number : change.removed) {
    std::erase_if(loops, [&](const GraphLoop& loop) { return loop.number == number; });
  }
  for (GraphLoop& loop : change.altered) {
    *std::ranges::find(loops, loop.number, &GraphLoop::number) = std::move(loop);
  }
  std::ranges::move(change.appended, std::back_inserter(loops));
}

LoopListChange LoopListMemory::next(const std::vector<GraphLoop>& loops) {
  LoopListChange change;
  std::vector<Known> now;
  now.reserve(loops.size());
  for (const GraphLoop& loop : loops) now.push_back({loop.number, to_bytes(loop)});
  // Lists lose loops anywhere and gain them at the end. What has changed its place is taken out and put back in.
  std::size_t place = 0;
  for (const Known& before : known_) {
    if (place == now.size() || now[place].number != before.number) {
      change.removed.push_back(before.number);
      continue;
    }
    if (now[place].bytes != before.bytes) change.altered.push_back(loops[place]);
    ++place;
  }
  change.appended.assign(loops.begin() + static_cast<std::ptrdiff_t>(place), loops.end());
  known_ = std::move(now);
  return change;
}

}  // namespace ignis
