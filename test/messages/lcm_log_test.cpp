// SPDX-License-Identifier: Apache-2.0
#include "messages/lcm_log.h"

#include <fstream>
#include <random>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>

#include "test_folder.h"

namespace ignis::messages {
namespace {

class LcmLogTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = folder_ / "test.lcmlog";
    // LCM's own writer is the oracle of the format.
    lcm::LogFile writer(file_.string(), "w");
    ASSERT_TRUE(writer.good());
    for (int i = 0; i < kRecords; ++i) {
      std::vector<unsigned char> data(static_cast<std::size_t>(20 + i), static_cast<unsigned char>(i));
      lcm::LogEvent event;
      event.eventnum = i;
      event.timestamp = 1'000 * i;
      event.channel = i % 2 == 0 ? "EVEN" : "ODD";
      event.datalen = static_cast<int>(data.size());
      event.data = data.data();
      ASSERT_EQ(writer.writeEvent(&event), 0);
    }
  }

  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::vector<char> bytes() const {
    std::ifstream stream(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void write(const std::vector<char>& content) const {
    std::ofstream(file_, std::ios::binary).write(content.data(), std::ssize(content));
  }
  [[nodiscard]] int count_records(std::int64_t* damaged = nullptr) const {
    LcmLog log(file_);
    int records = 0;
    while (log.next()) ++records;
    if (damaged != nullptr) *damaged = log.damaged_bytes();
    return records;
  }

  static constexpr int kRecords = 40;
  std::filesystem::path folder_ = test::fresh_folder();
  std::filesystem::path file_;
};

/// [bytes] of files that this process has in memory.
std::int64_t resident_file_bytes() {
  std::int64_t size = 0;
  std::int64_t resident = 0;
  std::int64_t shared = 0;
  std::ifstream("/proc/self/statm") >> size >> resident >> shared;
  return shared * sysconf(_SC_PAGESIZE);
}

TEST_F(LcmLogTest, GivesMemoryBackAndReadsOn) {
  constexpr std::int64_t kBytes = std::int64_t{48} << 20;
  {
    lcm::LogFile writer(file_.string(), "w");
    std::vector<unsigned char> data(1 << 20, 7);
    lcm::LogEvent event{.eventnum = 0, .timestamp = 0, .channel = "A", .datalen = 1 << 20, .data = data.data()};
    for (int i = 0; i < 48; ++i) ASSERT_EQ(writer.writeEvent(&event), 0);
  }
  LcmLog log(file_);
  std::int64_t sum = 0;
  std::optional<LogEvent> last;
  while (const std::optional<LogEvent> event = log.next()) {
    for (const std::byte byte : event->data) sum += std::to_integer<int>(byte);
    last = event;
  }
  EXPECT_EQ(sum, 7 * kBytes);
  const std::int64_t before = resident_file_bytes();
  log.release_memory();
  EXPECT_LT(resident_file_bytes(), before - kBytes / 2);
  EXPECT_EQ(std::to_integer<int>(last->data.back()), 7) << "views stay valid";
}

TEST_F(LcmLogTest, ReadsWhatLcmWrote) {
  LcmLog log(file_);
  for (int i = 0; i < kRecords; ++i) {
    const std::optional<LogEvent> event = log.next();
    ASSERT_TRUE(event);
    EXPECT_EQ(event->log_utime, 1'000 * i);
    EXPECT_EQ(event->channel, i % 2 == 0 ? "EVEN" : "ODD");
    ASSERT_EQ(std::ssize(event->data), 20 + i);
    EXPECT_EQ(event->data.back(), static_cast<std::byte>(i));
  }
  EXPECT_FALSE(log.next());
  EXPECT_EQ(log.damaged_bytes(), 0);
}

TEST_F(LcmLogTest, ReadsEveryWholeRecordWhereverTheLogIsCut) {
  const std::vector<char> whole = bytes();
  for (std::size_t size = 60; size < whole.size(); size += 7) {
    write({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    std::int64_t damaged = 0;
    const int records = count_records(&damaged);
    std::size_t expected_bytes = 0;
    for (int i = 0; i < records; ++i) expected_bytes += 28 + (i % 2 == 0 ? 4 : 3) + static_cast<std::size_t>(20 + i);
    EXPECT_EQ(static_cast<std::int64_t>(size - expected_bytes), damaged) << "cut at " << size;
  }
}

TEST_F(LcmLogTest, LosesOnlyTheRecordThatWasTouched) {
  const std::vector<char> whole = bytes();
  std::mt19937 random(11);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<char> altered = whole;
    const std::size_t at = 60 + random() % (whole.size() - 60);
    altered[at] = static_cast<char>(altered[at] ^ static_cast<char>(1U << (random() % 8U)));
    write(altered);
    EXPECT_GE(count_records(), kRecords - 1) << "altered byte " << at;
  }
}

TEST_F(LcmLogTest, NeverTrustsAnAnnouncedLength) {
  std::vector<char> altered = bytes();
  altered[24] = 0x7f;
  altered[25] = altered[26] = altered[27] = static_cast<char>(0xff);
  write(altered);
  std::int64_t damaged = 0;
  EXPECT_EQ(count_records(&damaged), kRecords - 1);
  EXPECT_EQ(damaged, 28 + 4 + 20);
}

TEST_F(LcmLogTest, SaysWhatIsWrongWithAFile) {
  const auto message_for = [](const std::filesystem::path& file) -> std::string {
    try {
      LcmLog log(file);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message_for(file_.string() + ".none").find("no such file"), std::string::npos);
  EXPECT_NE(message_for(testing::TempDir()).find("not a file"), std::string::npos);
  write({});
  EXPECT_NE(message_for(file_).find("is empty"), std::string::npos);
  write(std::vector<char>(1000, 'x'));
  EXPECT_NE(message_for(file_).find("is it an LCM log?"), std::string::npos);
}

}  // namespace
}  // namespace ignis::messages
