// SPDX-License-Identifier: Apache-2.0
#include "graph_backend/journal_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "test_folder.h"

namespace ignis {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::byte>;

Bytes payload(unsigned seed) {
  std::mt19937 random(seed);
  Bytes bytes(100 + random() % 5000);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

class JournalFileTest : public ::testing::Test {
 protected:
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] fs::path file() const { return folder_ / "graph_backend.journal"; }

  fs::path folder_ = test::fresh_folder();
  JournalHead head_{kJournalVersion, "of this test", 3};
};

TEST_F(JournalFileTest, ReadsBackEveryRecordAndNoOther) {
  JournalFile journal(folder_);
  journal.begin(head_);
  for (unsigned i = 0; i < 20; ++i) journal.append(payload(i));
  for (unsigned i = 0; i < 20; ++i) EXPECT_EQ(journal.read(i), payload(i));
  EXPECT_FALSE(journal.read(20));
  EXPECT_FALSE(journal.read(SIZE_MAX));
}

TEST_F(JournalFileTest, ReadsBackTheRecordsOfTheProcessBeforeItByTheirNumbers) {
  {
    JournalFile journal(folder_);
    journal.begin(head_);
    for (unsigned i = 0; i < 10; ++i) journal.append(payload(i));
  }
  JournalFile journal(folder_);
  const std::optional<LoadedJournal> loaded = journal.load();
  ASSERT_TRUE(loaded && loaded->contents.payloads.size() == 10);
  journal.resume(*loaded, 7, false);
  journal.append(payload(100));
  for (unsigned i = 0; i < 7; ++i) EXPECT_EQ(journal.read(i), payload(i));
  EXPECT_EQ(journal.read(7), payload(100));
  EXPECT_FALSE(journal.read(8));
}

TEST_F(JournalFileTest, ReadsBackWhatWaitsForRoomOnTheDisk) {
  JournalFile journal(folder_);
  // A file that accepts nothing.
  fs::create_symlink("/dev/full", file());
  LoadedJournal empty;
  empty.contents.head = head_;
  journal.resume(empty, 0, false);
  for (unsigned i = 0; i < 5; ++i) journal.append(payload(i));
  EXPECT_NE(journal.failure(), "");
  for (unsigned i = 0; i < 5; ++i) EXPECT_EQ(journal.read(i), payload(i));
  EXPECT_FALSE(journal.read(5));
}

TEST_F(JournalFileTest, DoesNotReadBackARecordThatHasBeenAltered) {
  JournalFile journal(folder_);
  journal.begin(head_);
  std::vector<std::uintmax_t> begins;
  for (unsigned i = 0; i < 3; ++i) {
    begins.push_back(fs::file_size(file()));
    journal.append(payload(i));
  }
  std::fstream(file(), std::ios::in | std::ios::out | std::ios::binary)
          .seekp(static_cast<std::streamoff>(begins[1] + 40))
      << "altered";
  EXPECT_EQ(journal.read(0), payload(0));
  EXPECT_FALSE(journal.read(1));
  EXPECT_EQ(journal.read(2), payload(2));
  fs::resize_file(file(), begins[2] + 5);
  EXPECT_FALSE(journal.read(2));
}

TEST_F(JournalFileTest, KnowsNoRecordOfTheDriveBefore) {
  JournalFile journal(folder_);
  journal.begin(head_);
  journal.append(payload(1));
  journal.begin(head_);
  EXPECT_FALSE(journal.read(0));
  journal.append(payload(2));
  EXPECT_EQ(journal.read(0), payload(2));
}

}  // namespace
}  // namespace ignis
