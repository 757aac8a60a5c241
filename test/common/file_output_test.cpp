// SPDX-License-Identifier: Apache-2.0
#include "common/file_output.h"

#include <gtest/gtest.h>

#include "test_folder.h"

namespace ignis {
namespace {

class FileOutputTest : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove_all(folder_); }

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
  std::ifstream stream(folder_ / "result.txt");
  std::string text;
  stream >> text;
  EXPECT_EQ(text, "old");
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
