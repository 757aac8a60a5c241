// SPDX-License-Identifier: Apache-2.0
#include "graph_backend/journal_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <fstream>
#include <functional>
#include <random>
#include <thread>

#include <sys/syscall.h>
#include <unistd.h>

#include "test_folder.h"

namespace {

/// A disk that breaks. It takes what it is given and forgets it: a kernel that could not write a page back says so at
/// the next sync, once, and then calls the page clean. Of what is read it gives the first bytes.
std::atomic<bool> disk_forgets = false;
std::atomic<off_t> disk_gives = -1;  // -1: everything

}  // namespace

extern "C" int fdatasync(int file) {
  if (!disk_forgets) return fsync(file);
  const off_t size = lseek(file, 0, SEEK_END);
  const std::vector<char> nothing(static_cast<std::size_t>(size - size / 2));
  static_cast<void>(pwrite(file, nothing.data(), nothing.size(), size / 2));
  errno = EIO;
  return -1;
}

extern "C" ssize_t pread(int file, void* data, std::size_t size, off_t at) {
  if (disk_gives >= 0 && at >= disk_gives) {
    errno = EIO;
    return -1;
  }
  if (disk_gives >= 0) size = std::min(size, static_cast<std::size_t>(disk_gives - at));
  return syscall(SYS_pread64, file, data, size, at);
}

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
  void TearDown() override {
    disk_forgets = false;
    disk_gives = -1;
    fs::remove_all(folder_);
  }

  /// Maintains it, as the process does, until it holds or ten seconds have passed.
  static bool maintained_until(JournalFile& journal, const std::function<bool()>& holds) {
    for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10); !holds();) {
      if (std::chrono::steady_clock::now() > end) return false;
      journal.maintain();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
  }

  /// How many of the records with the payloads 0, 1, 2... a successor finds.
  [[nodiscard]] std::size_t found_by_a_successor() const {
    JournalFile journal(folder_);
    const std::optional<LoadedJournal> loaded = journal.load();
    if (!loaded || loaded->contents.head != head_) return 0;
    for (unsigned i = 0; i < loaded->contents.payloads.size(); ++i) {
      const std::span<const std::byte> found = loaded->contents.payloads[i];
      if (!std::ranges::equal(found, payload(i))) return 0;
    }
    return loaded->contents.payloads.size();
  }

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

using Fault_L1 = JournalFileTest;

TEST_F(Fault_L1, WhatTheDiskForgotWhenItWasSyncedIsWrittenOnceMore) {
  {
    JournalFile journal(folder_);
    journal.begin(head_);
    for (unsigned i = 0; i < 10; ++i) journal.append(payload(i));
    disk_forgets = true;
    ASSERT_TRUE(maintained_until(journal, [&] { return !journal.failure().empty(); }));
    EXPECT_NE(journal.failure().find("cannot be synced: Input/output error"), std::string::npos) << journal.failure();
    EXPECT_NE(journal.failure().find(file().string()), std::string::npos) << journal.failure();
    disk_forgets = false;
    for (unsigned i = 10; i < 15; ++i) journal.append(payload(i));
    for (unsigned i = 0; i < 15; ++i) EXPECT_EQ(journal.read(i), payload(i));
    EXPECT_TRUE(maintained_until(journal, [&] { return journal.failure().empty(); }));
  }
  EXPECT_EQ(found_by_a_successor(), 15U);
}

TEST_F(Fault_L1, AJournalThatIsRemovedIsWrittenOnceMore) {
  {
    JournalFile journal(folder_);
    journal.begin(head_);
    for (unsigned i = 0; i < 10; ++i) journal.append(payload(i));
    fs::remove_all(folder_);
    ASSERT_TRUE(maintained_until(journal, [&] { return !journal.failure().empty(); }));
    EXPECT_NE(journal.failure().find(file().string()), std::string::npos) << journal.failure();
    for (unsigned i = 10; i < 15; ++i) journal.append(payload(i));
    for (unsigned i = 0; i < 15; ++i) EXPECT_EQ(journal.read(i), payload(i));
    fs::create_directories(folder_);
    EXPECT_TRUE(maintained_until(journal, [&] { return journal.failure().empty(); }));
  }
  EXPECT_EQ(found_by_a_successor(), 15U);
}

TEST_F(Fault_L1, OfAJournalThatTheDiskGivesInPartWhatItGivesIsUsedAndTheFileKept) {
  {
    JournalFile journal(folder_);
    journal.begin(head_);
    for (unsigned i = 0; i < 10; ++i) journal.append(payload(i));
  }
  const auto whole = fs::file_size(file());
  disk_gives = static_cast<off_t>(whole / 2);
  {
    JournalFile journal(folder_);
    const std::optional<LoadedJournal> loaded = journal.load();
    ASSERT_TRUE(loaded);
    EXPECT_NE(loaded->contents.damage.find("Input/output error"), std::string::npos) << loaded->contents.damage;
    EXPECT_FALSE(loaded->contents.torn_tail) << "then the rest would be cut off without a copy";
    ASSERT_GT(loaded->contents.payloads.size(), 2U);
    ASSERT_LT(loaded->contents.payloads.size(), 10U);
    journal.resume(*loaded, 2, true);
    journal.append(payload(2));
    EXPECT_EQ(journal.failure(), "");
  }
  disk_gives = -1;
  EXPECT_EQ(found_by_a_successor(), 3U);
  fs::path kept = file();
  kept += ".damaged1";
  EXPECT_EQ(fs::file_size(kept), whole);
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
