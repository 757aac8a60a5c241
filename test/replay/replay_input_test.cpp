// SPDX-License-Identifier: Apache-2.0
#include "replay_input.h"

#include <algorithm>
#include <filesystem>
#include <memory>

#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>

#include "ignis/health_t.hpp"
#include "ignis/imu_t.hpp"
#include "ignis/pose_t.hpp"
#include "ignis/scan_t.hpp"
#include "test_folder.h"

namespace ignis {
namespace {

class ReplayInputTest : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& channel, std::vector<unsigned char> data) {
    lcm::LogEvent event;
    event.eventnum = number_++;
    event.timestamp = 1'000 * number_;
    event.channel = channel;
    event.datalen = static_cast<int>(data.size());
    event.data = data.data();
    ASSERT_EQ(writer_->writeEvent(&event), 0);
  }

  template <class Message>
  void write_message(const std::string& channel, const Message& message) {
    std::vector<unsigned char> data(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(data.data(), 0, static_cast<int>(data.size()));
    write(channel, std::move(data));
  }

  void write_imu(int index) {
    imu_t message{};
    message.utime = 4'000 * index;
    message.sequence = index;
    write_message("L1_IMU", message);
  }

  void write_scan(int index) {
    scan_t message{};
    message.utime = 50'000 * index;
    message.sequence = index;
    message.part_count = 1;
    write_message("L1_SCAN", message);
  }

  ReplayInput opened() {
    writer_.reset();  // flushes
    return ReplayInput(file_);
  }

  std::filesystem::path folder_ = test::fresh_folder();
  std::filesystem::path file_ = folder_ / "test.lcmlog";
  std::unique_ptr<lcm::LogFile> writer_ = std::make_unique<lcm::LogFile>(file_.string(), "w");
  int number_ = 0;
};

TEST_F(ReplayInputTest, ListsAForeignLogWhenItRefusesIt) {
  for (int i = 0; i < 3; ++i) write("POSE_BODY", {0x12, 0x34, 0x56, 0x78, 0x9a, 0xbc, 0xde, 0xf0, 1, 2, 3});
  write("L1_IMU", {1, 2, 3, 4, 5, 6, 7, 8, 9});  // our channel, somebody else's type
  write_message("GROUND_TRUTH", pose_t{});
  try {
    (void)opened();
    FAIL() << "a log without measurements was accepted";
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    for (const char* part : {"no usable message on L1_IMU", "POSE_BODY", "3 messages", "0x123456789abcdef0",
                             "none of ours", "GROUND_TRUTH", "pose_t"}) {
      EXPECT_NE(text.find(part), std::string::npos) << part << " in:\n" << text;
    }
  }
}

TEST_F(ReplayInputTest, HandsOutInOrderOfStampsWhateverTheOrderOfRecords) {
  for (const int i : {0, 2, 1, 30, 4, 3}) write_imu(i);
  for (const int i : {1, 0, 2}) write_scan(i);
  const ReplayInput input = opened();
  std::vector<Utime> stamps;
  input.run({.on_imu = [&](const ImuSample& sample) { stamps.push_back(sample.utime); },
             .on_scan = [&](const Scan& scan) { stamps.push_back(scan.utime); },
             .on_command = [](const lio_command_t&) { ADD_FAILURE() << "there is none"; },
             .proceed = [](Utime) { return true; }});
  EXPECT_EQ(stamps.size(), 9U);
  EXPECT_TRUE(std::ranges::is_sorted(stamps));
  EXPECT_EQ(input.inventory().out_of_order, 4);  // 1, 4 and 3 of the IMU, 0 of the scans
}

TEST_F(ReplayInputTest, HandsOutACommandBehindTheNewestSampleThatWasRecordedBeforeIt) {
  lio_command_t command{};
  command.utime = 1'000'000;
  write_message("LIO_COMMAND", command);  // nothing had begun that could end
  for (const int i : {0, 1, 3, 2}) write_imu(i);
  write_imu(500'000);  // a stamp of the far future
  write_message("LIO_COMMAND", command);
  for (const int i : {4, 5}) write_imu(i);
  write_scan(0);
  std::vector<Utime> stamps;
  const ReplayInput input = opened();
  input.run({.on_imu = [&](const ImuSample& sample) { stamps.push_back(sample.utime); },
             .on_scan = [](const Scan&) {},
             .on_command = [&](const lio_command_t& heard) { stamps.push_back(heard.utime); },
             .proceed = [](Utime) { return true; }});
  EXPECT_EQ(stamps, (std::vector<Utime>{0, 4'000, 8'000, 12'000, 1'000'000, 16'000, 20'000, 2'000'000'000}));
}

TEST_F(ReplayInputTest, NamesTheFirstOfAllGaps) {
  for (int i = 0; i < 50; ++i) {
    if (i != 40 && i != 41) write_imu(i);  // 156,000 us is the last ahead
  }
  for (const int i : {0, 1, 3, 4, 6}) write_scan(i);  // 50,000 us
  const ReplayInput input = opened();
  EXPECT_EQ(input.inventory().missing_imu, 2);
  EXPECT_EQ(input.inventory().missing_scans, 2);
  ASSERT_TRUE(input.inventory().first_drop);
  EXPECT_EQ(input.inventory().first_drop->utime, 50'000) << "the missing scan's results are of an instant behind it";
  EXPECT_EQ(input.inventory().first_drop->what, "1 of L1_SCAN missing in the log");
}

TEST_F(ReplayInputTest, DatesAReportedLossBackToTheLastReportThatKnewOfNone) {
  const auto write_health = [&](const char* process, Utime utime, std::int64_t lost) {
    health_t health{};
    health.utime = utime;
    health.process = process;
    health.num_receivers = 1;
    health.channels = {"L1_IMU"};
    health.received = {100};
    health.lost = {lost};
    health.rejected = {0};
    health.queue_drops = {0};
    write_message("HEALTH", health);
  };
  for (int i = 0; i < 50; ++i) write_imu(i);
  write_scan(0);
  write_health("lio_frontend", 20'000, 0);
  write_health("map_builder", 30'000, 0);
  write_health("lio_frontend", 120'000, 2);
  write_health("lio_frontend", 160'000, 2);
  const ReplayInput input = opened();
  ASSERT_TRUE(input.inventory().first_drop);
  EXPECT_EQ(input.inventory().first_drop->utime, 20'000);
}

TEST_F(ReplayInputTest, KnowsNoDropInAWholeLog) {
  for (int i = 0; i < 50; ++i) write_imu(i);
  for (int i = 0; i < 4; ++i) write_scan(i);
  EXPECT_FALSE(opened().inventory().first_drop);
}

}  // namespace
}  // namespace ignis
