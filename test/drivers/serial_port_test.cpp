// SPDX-License-Identifier: Apache-2.0
#include "drivers/serial_port.h"

#include <pty.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "drivers/l1_decoder.h"
#include "drivers/l1_samples.h"

namespace ignis::l1 {
namespace {

/// A real pseudo-terminal: the test holds the sensor's end.
class SerialPortTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::array<char, 256> name{};
    int far_end = -1;
    ASSERT_EQ(openpty(&sensor_, &far_end, name.data(), nullptr, nullptr), 0);
    device_ = name.data();
    close(far_end);
  }
  void TearDown() override { hang_up(); }

  void hang_up() {
    if (sensor_ >= 0) close(sensor_);
    sensor_ = -1;
  }
  void send(const samples::Bytes& bytes) const {
    ASSERT_EQ(::write(sensor_, bytes.data(), bytes.size()), std::ssize(bytes));
  }
  static std::string error_of(const std::filesystem::path& device) {
    try {
      const SerialPort port(device, 2'000'000);
    } catch (const LinkError& error) {
      return error.what();
    }
    return "";
  }

  int sensor_ = -1;
  std::filesystem::path device_;
};

TEST_F(SerialPortTest, PassesEveryByteValueUnchangedBothWays) {
  SerialPort port(device_, 2'000'000);
  samples::Bytes all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::byte>(i);
  send(all);
  samples::Bytes received;
  std::array<std::byte, 64> buffer{};
  while (received.size() < all.size()) {
    const std::size_t count = port.read(buffer, 1000);
    ASSERT_GT(count, 0U);
    received.insert(received.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(count));
  }
  EXPECT_EQ(received, all);

  port.write(all);
  samples::Bytes echoed(all.size());
  ASSERT_EQ(::read(sensor_, echoed.data(), echoed.size()), std::ssize(echoed));
  EXPECT_EQ(echoed, all);
}

TEST_F(SerialPortTest, ReadsNothingOnTimeout) {
  SerialPort port(device_, 2'000'000);
  std::array<std::byte, 64> buffer{};
  EXPECT_EQ(port.read(buffer, 10), 0U);
}

TEST_F(SerialPortTest, CarriesTheGoldenStreamIntoTheDecoder) {
  SerialPort port(device_, 2'000'000);
  L1Decoder decoder(DriverConfig{}, l1_extrinsics());
  const samples::Bytes stream = samples::read_bytes("golden_clean.bin");
  std::array<std::byte, 4096> buffer{};
  Utime arrival = 1'000'000;
  for (std::size_t begin = 0; begin < stream.size(); begin += 1000) {
    const std::size_t size = std::min<std::size_t>(1000, stream.size() - begin);
    send({stream.begin() + static_cast<std::ptrdiff_t>(begin),
          stream.begin() + static_cast<std::ptrdiff_t>(begin + size)});
    for (std::size_t got = 0; got < size;) {
      const std::size_t count = port.read(buffer, 1000);
      ASSERT_GT(count, 0U);
      (void)decoder.feed(std::span(buffer).first(count), arrival += 10'000);
      got += count;
    }
    const auto outgoing = decoder.take_outgoing();
    port.write(outgoing);
  }
  EXPECT_EQ(decoder.counters().pairing.paired, 36);
  EXPECT_EQ(decoder.counters().imu_published, 50);
  samples::Bytes answer(17);
  ASSERT_EQ(::read(sensor_, answer.data(), answer.size()), 17);
  EXPECT_EQ(answer[7], std::byte{kTimeSyncId});
}

TEST_F(SerialPortTest, SaysThatThePortIsMissing) {
  const std::string text = error_of("/dev/ttyIGNIS_does_not_exist");
  EXPECT_NE(text.find("does not exist"), std::string::npos) << text;
  EXPECT_NE(text.find("--port"), std::string::npos) << text;
}

TEST_F(SerialPortTest, SaysThatThePortIsBusy) {
  const SerialPort holder(device_, 2'000'000);
  EXPECT_NE(error_of(device_).find("in use by another process"), std::string::npos);
}

TEST_F(SerialPortTest, IsFreeAgainAfterClosing) {
  {
    const SerialPort first(device_, 2'000'000);
  }
  EXPECT_EQ(error_of(device_), "");
}

TEST_F(SerialPortTest, SaysThatAFileIsNoPort) {
  const auto file = std::filesystem::temp_directory_path() / ("ignis_serial_test_" + std::to_string(getpid()));
  std::ofstream(file) << "bytes";
  EXPECT_NE(error_of(file).find("--capture"), std::string::npos);
  std::filesystem::remove(file);
}

TEST_F(SerialPortTest, NoticesThatTheDeviceIsGone) {
  SerialPort port(device_, 2'000'000);
  hang_up();
  std::array<std::byte, 64> buffer{};
  EXPECT_THROW((void)port.read(buffer, 1000), LinkError);
}

}  // namespace
}  // namespace ignis::l1
