// SPDX-License-Identifier: Apache-2.0
#include "map_builder/map_journal.h"

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <string>

#include <sys/resource.h>

#include "test_folder.h"

namespace ignis {
namespace {

const std::string kConfig = "a configuration";

MapRecord record(std::int32_t id, bool is_keyframe, std::size_t points = 10) {
  MapRecord made;
  made.id = id;
  made.is_keyframe = is_keyframe;
  made.points.resize(points);
  return made;
}

/// Three keyframes with two scans each; returns their files.
std::vector<std::filesystem::path> write_drive(const std::filesystem::path& folder) {
  MapJournal journal(folder);
  journal.begin({.config_fingerprint = kConfig});
  std::vector<std::filesystem::path> files;
  for (std::int32_t id = 0; id < 3; ++id) {
    journal.append(record(id, true));
    journal.append(record(id, false));
    journal.append(record(id, false));
    files.push_back(folder / ("map_keyframe_" + std::to_string(id)));
  }
  EXPECT_EQ(journal.failure(), "");
  return files;
}

void flip(const std::filesystem::path& path, std::streamoff at) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(at);
  const char byte = static_cast<char>(file.get() ^ 0x10);
  file.seekp(at);
  file.put(byte);
}

TEST(MapJournal, GivesBackWhatWasWritten) {
  const std::filesystem::path folder = test::fresh_folder();
  write_drive(folder);
  MapJournal journal(folder);
  const auto loaded = journal.load(kConfig);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->records.size(), 9U);
  EXPECT_EQ(journal.damage(), "");
}

TEST(MapJournal, NamesEveryFileWhereverAByteOfItIsAltered) {
  const std::filesystem::path folder = test::fresh_folder();
  const auto size = static_cast<std::streamoff>(std::filesystem::file_size(write_drive(folder)[1]));
  for (std::streamoff at = 0; at < size; ++at) {
    flip(write_drive(folder)[1], at);
    MapJournal journal(folder);
    const auto loaded = journal.load(kConfig);
    ASSERT_TRUE(loaded) << "the other two are whole";
    EXPECT_GE(loaded->records.size(), 6U);
    EXPECT_LT(loaded->records.size(), 9U);
    EXPECT_EQ(journal.damage().find("map_keyframe_1: "), 0U) << "byte " << at << ": " << journal.damage();
  }
}

TEST(MapJournal, NamesDamageWhereNothingIsLeftToGoOnWith) {
  const std::filesystem::path folder = test::fresh_folder();
  for (const std::filesystem::path& file : write_drive(folder)) flip(file, 20);
  MapJournal journal(folder);
  EXPECT_FALSE(journal.load(kConfig));
  EXPECT_NE(journal.damage().find("3 files"), std::string::npos) << journal.damage();
}

TEST(MapJournal, DoesNotCallItDamageThatAFileIsOfAnotherConfiguration) {
  const std::filesystem::path folder = test::fresh_folder();
  write_drive(folder);
  MapJournal journal(folder);
  EXPECT_FALSE(journal.load("another configuration"));
  EXPECT_EQ(journal.damage(), "");
}

/// While it lives no file grows beyond so many bytes, as on a disk that is nearly full.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

TEST(Fault_L1, WhatTheMapsJournalCouldNotWriteIsWrittenOnceTheDiskTakesIt) {
  const std::filesystem::path folder = test::fresh_folder();
  {
    MapJournal journal(folder);
    journal.begin({.config_fingerprint = kConfig});
    journal.append(record(0, true, 10));
    {
      const FullDisk disk(2000);
      journal.append(record(0, false, 1000));
      journal.append(record(0, false, 10));
      journal.append(record(1, true, 10));
    }
    EXPECT_NE(journal.failure().find("cannot be written"), std::string::npos) << journal.failure();
    EXPECT_NE(journal.failure().find(folder.string()), std::string::npos) << journal.failure();
    journal.append(record(1, false, 10));
    EXPECT_EQ(journal.failure(), "");
  }
  MapJournal journal(folder);
  const auto loaded = journal.load(kConfig);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->records.size(), 5U);
  EXPECT_EQ(journal.damage(), "");
}

TEST(Fault_L1, WhatWaitsForTheDiskIsWrittenInPiecesAndTheRestAtTheEnd) {
  constexpr std::size_t kPoints = 200'000;  // two of these are more than one append writes
  const std::filesystem::path folder = test::fresh_folder();
  const auto size = [&] { return std::filesystem::file_size(folder / "map_keyframe_0"); };
  std::size_t after_one = 0;
  {
    MapJournal journal(folder);
    journal.begin({.config_fingerprint = kConfig});
    {
      const FullDisk disk(2000);
      for (int i = 0; i < 6; ++i) journal.append(record(0, i == 0, kPoints));
    }
    journal.append(record(0, false, 10));
    after_one = size();
    EXPECT_GT(after_one, 4U << 20U);
    EXPECT_LT(after_one, 8U << 20U);
    EXPECT_NE(journal.failure(), "") << "most of it waits still";
  }
  EXPECT_GT(size(), 2 * after_one);
  MapJournal journal(folder);
  const auto loaded = journal.load(kConfig);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->records.size(), 7U);
}

TEST(MapJournal, TellsALostRecordUntilItBeginsAnewThoughLaterOnesFit) {
  constexpr std::size_t kPoints = 2'000'000;  // three of these are more than waits in memory
  const std::filesystem::path folder = test::fresh_folder();
  MapJournal journal(folder);
  journal.begin({.config_fingerprint = kConfig});
  {
    const FullDisk disk(2000);
    for (int i = 0; i < 3; ++i) journal.append(record(0, i == 0, kPoints));
  }
  EXPECT_NE(journal.failure().find("cannot be written"), std::string::npos) << journal.failure();
  EXPECT_NE(journal.failure().find("1 records are lost"), std::string::npos) << journal.failure();
  journal.append(record(1, true, 10));
  EXPECT_NE(journal.failure(), "") << "what was lost is lost still";
  journal.begin({.config_fingerprint = kConfig, .session = 1});
  EXPECT_EQ(journal.failure(), "");
}

TEST(Fault_L1, AFileOfTheMapsJournalThatTheDiskDoesNotGiveCostsThatKeyframeAlone) {
  const std::filesystem::path folder = test::fresh_folder();
  const std::filesystem::path file = write_drive(folder)[1];
  std::filesystem::remove(file);
  std::filesystem::create_directory(file);  // it opens, and reading fails
  MapJournal journal(folder);
  const auto loaded = journal.load(kConfig);
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->records.size(), 6U);
  EXPECT_EQ(journal.damage().find("map_keyframe_1: the disk does not give it back"), 0U) << journal.damage();
}

TEST(Fault_L1, AFileOfTheMapsJournalThatIsRemovedWhileItIsWrittenIsTold) {
  const std::filesystem::path folder = test::fresh_folder();
  MapJournal journal(folder);
  journal.begin({.config_fingerprint = kConfig});
  journal.append(record(0, true));
  std::filesystem::remove(folder / "map_keyframe_0");
  journal.append(record(0, false));
  EXPECT_NE(journal.failure().find("was removed"), std::string::npos) << journal.failure();
}

}  // namespace
}  // namespace ignis
