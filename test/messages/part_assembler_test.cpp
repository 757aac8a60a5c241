// SPDX-License-Identifier: Apache-2.0
#include "messages/part_assembler.h"

#include <gtest/gtest.h>

namespace ignis::messages {
namespace {

struct Part {
  std::int32_t sequence;
  std::int16_t part;
  std::int16_t part_count;
};

TEST(PartAssembler, HandsOverPartsInOrderWhateverTheirArrival) {
  PartAssembler<Part> assembler;
  EXPECT_FALSE(assembler.add({1, 2, 3}));
  EXPECT_FALSE(assembler.add({1, 0, 3}));
  EXPECT_FALSE(assembler.add({1, 0, 3})) << "a repeat completes nothing";
  const auto complete = assembler.add({1, 1, 3});
  ASSERT_TRUE(complete);
  ASSERT_EQ(complete->size(), 3U);
  for (int i = 0; i < 3; ++i) EXPECT_EQ((*complete)[static_cast<std::size_t>(i)].part, i);
  EXPECT_EQ(assembler.incomplete(), 0);
}

TEST(PartAssembler, CountsASequenceThatANewerOneReplaces) {
  PartAssembler<Part> assembler;
  EXPECT_FALSE(assembler.add({1, 0, 2}));
  EXPECT_TRUE(assembler.add({2, 0, 1}));
  EXPECT_EQ(assembler.incomplete(), 1);
  EXPECT_FALSE(assembler.add({3, 0, 2}));
  EXPECT_FALSE(assembler.add({4, 0, 2}));
  EXPECT_EQ(assembler.incomplete(), 2);
}

TEST(PartAssembler, TakesAPartThatComesAgainBehindTheWholeForNoLoss) {
  PartAssembler<Part> assembler;
  EXPECT_FALSE(assembler.add({7, 0, 2}));
  EXPECT_TRUE(assembler.add({7, 1, 2}));
  EXPECT_FALSE(assembler.add({7, 1, 2}));
  EXPECT_FALSE(assembler.add({8, 0, 2}));
  EXPECT_FALSE(assembler.add({7, 0, 2})) << "nor does it end the wait for the next one";
  EXPECT_TRUE(assembler.add({8, 1, 2}));
  EXPECT_EQ(assembler.incomplete(), 0);
}

TEST(PartAssembler, HandsOverASequenceAgainThatIsSentAgainAsAWhole) {
  PartAssembler<Part> assembler;
  for (const std::int32_t sequence : {0, 1, 0, 0}) {
    EXPECT_FALSE(assembler.add({sequence, 0, 2}));
    EXPECT_TRUE(assembler.add({sequence, 1, 2})) << sequence;
  }
  EXPECT_EQ(assembler.incomplete(), 0);
}

TEST(PartAssembler, RefusesImpossibleNumbering) {
  PartAssembler<Part> assembler;
  EXPECT_FALSE(assembler.add({1, 0, 0}));
  EXPECT_FALSE(assembler.add({1, -1, 2}));
  EXPECT_FALSE(assembler.add({1, 2, 2}));
  EXPECT_EQ(assembler.incomplete(), 3);
}

TEST(Fault_B5, ASequenceOfMorePartsThanAnyHonestOneIsRefused) {
  PartAssembler<Part> assembler;
  EXPECT_FALSE(assembler.add({1, 0, kMostParts}));
  EXPECT_EQ(assembler.waiting(), 1U);
  EXPECT_EQ(assembler.incomplete(), 0);
  EXPECT_FALSE(assembler.add({2, 0, kMostParts + 1}));
  EXPECT_EQ(assembler.incomplete(), 1);
  EXPECT_FALSE(assembler.add({1, 1, kMostParts}));
  EXPECT_EQ(assembler.waiting(), 2U) << "nor does it end the wait for another";
}

/// Counts how many of it live.
struct CountedPart : Part {
  CountedPart(std::int32_t number, std::int16_t place, std::int16_t places) : Part{number, place, places} { ++alive; }
  CountedPart(const CountedPart& other) : Part(other) { ++alive; }
  CountedPart& operator=(const CountedPart&) = default;
  ~CountedPart() { --alive; }
  static inline int alive = 0;
};

TEST(Fault_B5, AnAnnouncedNumberOfPartsCostsNoMemory) {
  PartAssembler<CountedPart> assembler;
  EXPECT_FALSE(assembler.add({1, 0, kMostParts}));
  EXPECT_FALSE(assembler.add({1, 9, kMostParts}));
  EXPECT_EQ(CountedPart::alive, 2);
  static_assert(sizeof(PartAssembler<CountedPart>) < 100, "nothing is set aside for parts to come");
}

TEST(PartAssembler, BeginsAnewWhenThePartsDisagreeAboutTheirNumber) {
  PartAssembler<Part> assembler;
  EXPECT_FALSE(assembler.add({1, 0, 3}));
  EXPECT_FALSE(assembler.add({1, 1, 2}));
  EXPECT_EQ(assembler.incomplete(), 1);
  EXPECT_TRUE(assembler.add({1, 0, 2}));
}

}  // namespace
}  // namespace ignis::messages
