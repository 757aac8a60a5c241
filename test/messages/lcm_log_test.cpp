// SPDX-License-Identifier: Apache-2.0
#include "messages/lcm_log.h"

#include <algorithm>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>

#include "test_folder.h"

namespace ignis::messages {
namespace {

/// What stands in a record.
struct Record {
  std::int64_t number = 0;
  std::int64_t log_utime = 0;
  std::string channel;
  std::vector<unsigned char> data;

  bool operator==(const Record&) const = default;
};

class LcmLogTest : public testing::Test {
 protected:
  void SetUp() override {
    file_ = folder_ / "test.lcmlog";
    // LCM's own writer is the oracle of the format.
    lcm::LogFile writer(file_.string(), "w");
    ASSERT_TRUE(writer.good());
    for (int i = 0; i < kRecords; ++i) {
      Record record = written(i);
      lcm::LogEvent event;
      event.eventnum = record.number;
      event.timestamp = record.log_utime;
      event.channel = record.channel;
      event.datalen = static_cast<int>(record.data.size());
      event.data = record.data.data();
      ASSERT_EQ(writer.writeEvent(&event), 0);
    }
  }

  /// The record of this number, and how long it is in the file [bytes].
  [[nodiscard]] static Record written(int i) {
    return {.number = i,
            .log_utime = 1'000 * i,
            .channel = i % 2 == 0 ? "EVEN" : "ODD",
            .data = std::vector<unsigned char>(static_cast<std::size_t>(20 + i), static_cast<unsigned char>(i))};
  }
  [[nodiscard]] static std::size_t size_of(const Record& record) {
    return 28 + record.channel.size() + record.data.size();
  }

  [[nodiscard]] std::vector<Record> read(std::int64_t& damaged) const {
    LcmLog log(file_);
    std::vector<Record> records;
    while (const std::optional<LogEvent> event = log.next()) {
      const auto* begin = reinterpret_cast<const unsigned char*>(event->data.data());
      records.push_back({.number = event->number,
                         .log_utime = event->log_utime,
                         .channel = std::string(event->channel),
                         .data = {begin, begin + event->data.size()}});
    }
    damaged = log.damaged_bytes();
    return records;
  }

  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::vector<char> bytes() const {
    std::ifstream stream(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void write(const std::vector<char>& content) const {
    std::ofstream(file_, std::ios::binary).write(content.data(), std::ssize(content));
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
  std::vector<Record> expected;
  for (int i = 0; i < kRecords; ++i) expected.push_back(written(i));
  std::size_t whole_bytes = bytes().size();
  for (std::size_t size = whole_bytes; size >= size_of(written(0)); --size) {
    if (size < whole_bytes) {
      whole_bytes -= size_of(expected.back());
      expected.pop_back();
    }
    std::filesystem::resize_file(file_, size);
    std::int64_t damaged = 0;
    ASSERT_EQ(read(damaged), expected) << "cut at " << size;
    ASSERT_EQ(damaged, static_cast<std::int64_t>(size - whole_bytes)) << "cut at " << size;
  }
  EXPECT_EQ(std::ssize(expected), 1);
}

TEST_F(LcmLogTest, LosesOnlyTheRecordThatWasTouched) {
  const std::vector<char> whole = bytes();
  std::mt19937 random(11);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<char> altered = whole;
    const std::size_t at = 60 + random() % (whole.size() - 60);
    altered[at] = static_cast<char>(altered[at] ^ static_cast<char>(1U << (random() % 8U)));
    write(altered);
    std::vector<Record> others;
    for (std::size_t begin = 0, i = 0; begin < whole.size(); ++i) {
      const Record record = written(static_cast<int>(i));
      const std::size_t end = begin + size_of(record);
      if (at < begin || at >= end) others.push_back(record);
      begin = end;
    }
    std::int64_t damaged = 0;
    std::vector<Record> found = read(damaged);
    EXPECT_LE(found.size(), kRecords) << "altered byte " << at;
    std::erase_if(found, [&](const Record& record) { return !std::ranges::contains(others, record); });
    EXPECT_EQ(found, others) << "altered byte " << at;
  }
}

TEST_F(LcmLogTest, NeverTrustsAnAnnouncedLength) {
  std::vector<char> altered = bytes();
  altered[24] = 0x7f;
  altered[25] = altered[26] = altered[27] = static_cast<char>(0xff);
  write(altered);
  std::int64_t damaged = 0;
  const std::vector<Record> found = read(damaged);
  EXPECT_EQ(std::ssize(found), kRecords - 1);
  EXPECT_EQ(found.front(), written(1));
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
