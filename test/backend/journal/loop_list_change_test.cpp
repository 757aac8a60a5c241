// SPDX-License-Identifier: Apache-2.0
#include "backend/journal/loop_list_change.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace ignis {
namespace {

GraphLoop loop_of(std::int32_t number) {
  GraphLoop loop;
  loop.number = number;
  loop.rows = WhiteningRows::Identity(6, 6);
  return loop;
}

/// As bytes, so that all fields count.
std::vector<std::byte> bytes_of(const std::vector<GraphLoop>& loops) {
  std::vector<std::byte> bytes;
  ByteWriter writer(bytes);
  writer.list(loops);
  return bytes;
}

TEST(LoopListChange, MakesTheNewListOfTheOldOneAfterAnySequence) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    std::mt19937 random(seed);
    std::vector<GraphLoop> loops;
    std::vector<GraphLoop> followed;
    LoopListMemory memory;
    for (std::int32_t step = 0; step < 60; ++step) {
      for (unsigned events = random() % 4; events > 0; --events) {
        const auto any = loops.empty() ? loops.end() : loops.begin() + random() % loops.size();
        const unsigned event = random() % 4;
        if (event <= 1) loops.push_back(loop_of(10 * step + static_cast<std::int32_t>(events)));
        if (event == 2 && any != loops.end()) loops.erase(any);
        if (event == 3 && any != loops.end()) any->result.reason_text += "x";
        if (random() % 10 == 0 && loops.size() > 1) std::ranges::swap(loops.front(), loops.back());
      }
      LoopListChange change = memory.next(loops);
      ASSERT_TRUE(fits(change, followed));
      apply_to(followed, std::move(change));
      ASSERT_EQ(bytes_of(followed), bytes_of(loops)) << "seed " << seed << " step " << step;
    }
  }
}

TEST(LoopListChange, NamesOnlyWhatChanged) {
  std::vector<GraphLoop> loops;
  for (std::int32_t number = 0; number < 100; ++number) loops.push_back(loop_of(number));
  LoopListMemory memory;
  static_cast<void>(memory.next(loops));
  loops.erase(loops.begin() + 40);
  loops[70].result.stage = LoopStage::kKept;
  loops.push_back(loop_of(100));
  const LoopListChange change = memory.next(loops);
  EXPECT_EQ(change.removed, std::vector<std::int32_t>{40});
  ASSERT_EQ(change.altered.size(), 1U);
  EXPECT_EQ(change.altered[0].number, 71);
  ASSERT_EQ(change.appended.size(), 1U);
  EXPECT_EQ(change.appended[0].number, 100);
}

TEST(LoopListChange, DoesNotFitWhereItsLoopsAreMissing) {
  const std::vector<GraphLoop> loops{loop_of(1), loop_of(2)};
  EXPECT_TRUE(fits({{1}, {loop_of(2)}, {}}, loops));
  EXPECT_FALSE(fits({{3}, {}, {}}, loops));
  EXPECT_FALSE(fits({{}, {loop_of(3)}, {}}, loops));
  EXPECT_FALSE(fits({{2}, {loop_of(2)}, {}}, loops)) << "removed before it is altered";
}

}  // namespace
}  // namespace ignis
