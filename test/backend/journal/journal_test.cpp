// SPDX-License-Identifier: Apache-2.0
#include "backend/journal/journal.h"

#include <gtest/gtest.h>

#include <random>

#include "backend/journal/graph_change.h"

namespace ignis {
namespace {

using Bytes = std::vector<std::byte>;

Bytes random_bytes(std::size_t size, std::mt19937& random) {
  Bytes bytes(size);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

void append(Bytes& bytes, const Bytes& more) { bytes.insert(bytes.end(), more.begin(), more.end()); }

/// A journal of a few records, and where each of them ends.
struct Sample {
  JournalHead head{kJournalVersion, "0123456789abcdef", 7};
  std::vector<Bytes> payloads;
  Bytes bytes;
  std::vector<std::size_t> ends;

  Sample() {
    std::mt19937 random(3);
    bytes = encode_head(head);
    ends.push_back(bytes.size());
    for (const std::size_t size : {1U, 40U, 9U, 120U}) {
      payloads.push_back(random_bytes(size, random));
      append(bytes, encode_record(payloads.back()));
      ends.push_back(bytes.size());
    }
  }

  /// Records that end at or before `size`.
  [[nodiscard]] std::size_t whole_within(std::size_t size) const {
    return static_cast<std::size_t>(std::ranges::count_if(ends, [&](std::size_t end) { return end <= size; }));
  }
};

void expect_first(const JournalContents& contents, const Sample& sample, std::size_t count) {
  ASSERT_EQ(contents.payloads.size(), count);
  for (std::size_t i = 0; i < count; ++i) {
    EXPECT_TRUE(std::ranges::equal(contents.payloads[i], sample.payloads[i]));
  }
}

TEST(Journal, ReadsBackHeadAndRecords) {
  const Sample sample;
  const JournalContents contents = read_journal(sample.bytes);
  ASSERT_TRUE(contents.is_journal);
  EXPECT_EQ(contents.head, sample.head);
  EXPECT_EQ(contents.damage, "");
  EXPECT_EQ(contents.whole_bytes, sample.bytes.size());
  expect_first(contents, sample, 4);
}

TEST(Journal, CutAnywhereKeepsEveryWholeRecordAndSaysSo) {
  const Sample sample;
  for (std::size_t size = 0; size < sample.bytes.size(); ++size) {
    const JournalContents contents = read_journal(std::span(sample.bytes).first(size));
    const std::size_t whole = sample.whole_within(size);
    EXPECT_EQ(contents.is_journal, whole > 0) << size;
    if (whole == 0) {
      EXPECT_TRUE(contents.torn_tail) << size;
      continue;
    }
    expect_first(contents, sample, whole - 1);
    EXPECT_EQ(contents.whole_bytes, sample.ends[whole - 1]);
    const bool is_clean = size == sample.ends[whole - 1];
    EXPECT_EQ(contents.damage.empty(), is_clean) << size;
    EXPECT_EQ(contents.torn_tail, !is_clean) << size;
  }
}

TEST(Journal, EveryAlteredByteIsNoticedAndWhatStandsBeforeItKept) {
  const Sample sample;
  for (std::size_t i = 0; i < sample.bytes.size(); ++i) {
    Bytes bytes = sample.bytes;
    bytes[i] ^= std::byte{0x10};
    const JournalContents contents = read_journal(bytes);
    const std::size_t whole = sample.whole_within(i);
    EXPECT_FALSE(contents.damage.empty()) << i;
    EXPECT_EQ(contents.is_journal, whole > 0) << i;
    if (whole > 0) expect_first(contents, sample, whole - 1);
  }
}

TEST(Journal, SurvivesAnyBytes) {
  std::mt19937 random(5);
  const Sample sample;
  for (int run = 0; run < 20'000; ++run) {
    Bytes bytes = run % 2 == 0 ? random_bytes(random() % 200, random) : sample.bytes;
    for (int i = 0; i < 5 && !bytes.empty(); ++i) bytes[random() % bytes.size()] = static_cast<std::byte>(random());
    const JournalContents contents = read_journal(bytes);
    EXPECT_LE(contents.whole_bytes, bytes.size());
    // Behind a checksum nothing random arrives; the decoder must survive it all the same.
    static_cast<void>(decode_change(bytes));
  }
}

}  // namespace
}  // namespace ignis
