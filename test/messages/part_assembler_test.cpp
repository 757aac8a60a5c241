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

TEST(PartAssembler, RefusesImpossibleNumbering) {
  PartAssembler<Part> assembler;
  EXPECT_FALSE(assembler.add({1, 0, 0}));
  EXPECT_FALSE(assembler.add({1, -1, 2}));
  EXPECT_FALSE(assembler.add({1, 2, 2}));
  EXPECT_EQ(assembler.incomplete(), 3);
}

}  // namespace
}  // namespace ignis::messages
