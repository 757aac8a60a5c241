// SPDX-License-Identifier: Apache-2.0
#include "common/file_output.h"

#include <cerrno>
#include <format>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "test_folder.h"

namespace {

int sync_error = 0;
std::vector<std::filesystem::path> synced;

}  // namespace

/// Stands in for the system's: notes what is synced, and whether the new file has its name by then, or fails.
extern "C" int fsync(int descriptor) {
  const auto path = std::filesystem::read_symlink(std::format("/proc/self/fd/{}", descriptor));
  synced.push_back(path);
  if (std::filesystem::exists(path / "result.txt")) synced.emplace_back("result.txt is there");
  errno = sync_error;
  return sync_error == 0 ? 0 : -1;
}

namespace ignis {
namespace {

class FileOutputTest : public testing::Test {
 protected:
  void SetUp() override {
    sync_error = 0;
    synced.clear();
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string content() const {
    std::ifstream stream(folder_ / "result.txt");
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  std::filesystem::path folder_ = test::fresh_folder();
};

TEST_F(FileOutputTest, AppearsUnderItsNameOnlyAfterCommit) {
  FileOutput output(folder_ / "result.txt");
  output.stream() << "done";
  EXPECT_FALSE(std::filesystem::exists(folder_ / "result.txt"));
  output.commit();
  EXPECT_TRUE(std::filesystem::exists(folder_ / "result.txt"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "result.txt.tmp"));
}

TEST_F(FileOutputTest, LeavesTheOldFileAndNoRestWhenAbandoned) {
  {
    FileOutput first(folder_ / "result.txt");
    first.stream() << "old";
    first.commit();
  }
  {
    FileOutput second(folder_ / "result.txt");
  }
  EXPECT_EQ(content(), "old");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "result.txt.tmp"));
}

TEST_F(FileOutputTest, NamesThePathWhenItCannotWrite) {
  try {
    FileOutput output(folder_ / "missing" / "result.txt");
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("missing/result.txt"), std::string::npos);
  }
}

TEST_F(FileOutputTest, IsOnTheDiskBeforeItHasItsNameAndSoIsTheName) {
  FileOutput output(folder_ / "result.txt");
  output.stream() << "done";
  EXPECT_TRUE(synced.empty());
  output.commit();
  const std::vector<std::filesystem::path> expected{folder_ / "result.txt.tmp", folder_, "result.txt is there"};
  EXPECT_EQ(synced, expected);
}

TEST_F(FileOutputTest, WaitsForNoDiskWhereItNeedNot) {
  FileOutput output(folder_ / "result.txt", FileOutput::Sync::kNo);
  output.stream() << "done";
  output.commit();
  EXPECT_EQ(content(), "done");
  EXPECT_TRUE(synced.empty());
}

TEST_F(FileOutputTest, LeavesTheOldFileAndNoRestWhenTheDiskTakesNoMore) {
  {
    FileOutput first(folder_ / "result.txt");
    first.stream() << "old";
    first.commit();
  }
  sync_error = EIO;
  try {
    FileOutput second(folder_ / "result.txt");
    second.stream() << "new";
    second.commit();
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("result.txt.tmp: Input/output error"), std::string::npos) << error.what();
  }
  EXPECT_EQ(content(), "old");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "result.txt.tmp"));
}

TEST_F(FileOutputTest, RefusesToCommitToAFullDisk) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "not run, no /dev/full on this system";
  std::filesystem::create_symlink("/dev/full", folder_ / "result.txt.tmp");
  FileOutput output(folder_ / "result.txt");
  output.stream() << std::string(100000, 'x');
  EXPECT_THROW(output.commit(), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "result.txt"));
}

}  // namespace
}  // namespace ignis
