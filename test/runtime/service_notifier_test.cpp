// SPDX-License-Identifier: Apache-2.0
#include "runtime/service_notifier.h"

#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace ignis::runtime {
namespace {

/// Stands in for the supervisor: a datagram socket and the environment that names it.
class ServiceNotifierTest : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"NOTIFY_SOCKET", "WATCHDOG_USEC", "WATCHDOG_PID", "IGNIS_READY_FD"}) unsetenv(name);
  }
  void TearDown() override {
    SetUp();
    if (socket_ >= 0) close(socket_);
    std::filesystem::remove(path_);
  }

  void listen_as_systemd() {
    path_ = testing::TempDir() + "notify-" + std::to_string(getpid());
    std::filesystem::remove(path_);
    socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof(address.sun_path) - 1);
    ASSERT_EQ(bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    setenv("NOTIFY_SOCKET", path_.c_str(), 1);
  }

  std::vector<std::string> heard() {
    std::vector<std::string> messages;
    std::array<char, 256> buffer;
    for (ssize_t size; (size = recv(socket_, buffer.data(), buffer.size(), 0)) > 0;) {
      messages.emplace_back(buffer.data(), static_cast<std::size_t>(size));
    }
    return messages;
  }

  std::string path_;
  int socket_ = -1;
};

TEST_F(ServiceNotifierTest, SaysReadyOnceAtTheFirstTurn) {
  listen_as_systemd();
  ServiceNotifier notifier;
  EXPECT_TRUE(heard().empty());
  notifier.turn(1, 0.0);
  notifier.turn(2, 10.0);
  EXPECT_EQ(heard(), std::vector<std::string>{"READY=1"});
  notifier.status("OK");
  EXPECT_EQ(heard(), std::vector<std::string>{"STATUS=OK"});
}

TEST_F(ServiceNotifierTest, FeedsTheWatchdogFromProgressAndNotFromTime) {
  listen_as_systemd();
  setenv("WATCHDOG_USEC", "4000000", 1);
  ServiceNotifier notifier;
  notifier.turn(0, 0.0);
  (void)heard();
  notifier.turn(0, 2.0);
  notifier.turn(0, 3.9);
  EXPECT_TRUE(heard().empty()) << "fed although nothing was handled";
  notifier.turn(1, 4.0);
  EXPECT_EQ(heard(), std::vector<std::string>{"WATCHDOG=1"});
  notifier.turn(2, 4.1);
  EXPECT_TRUE(heard().empty()) << "fed far more often than needed";
  notifier.turn(3, 5.1);
  EXPECT_EQ(heard(), std::vector<std::string>{"WATCHDOG=1"});
  notifier.turn(3, 60.0);
  EXPECT_TRUE(heard().empty()) << "fed although nothing was handled since";
}

TEST_F(ServiceNotifierTest, FeedsTheWatchdogInTheMidstOfATurnToo) {
  listen_as_systemd();
  setenv("WATCHDOG_USEC", "2000000", 1);
  ServiceNotifier notifier;
  notifier.feed(1, 1.0);
  EXPECT_TRUE(heard().empty()) << "the supervisor waits for READY first";
  notifier.turn(1, 1.0);
  (void)heard();
  for (int part = 2; part <= 41; ++part) notifier.feed(part, 1.0 + 0.1 * part);
  EXPECT_GE(heard().size(), 7U) << "each half second of four";
  notifier.feed(42, 60.0);
  (void)heard();
  notifier.feed(42, 120.0);
  EXPECT_TRUE(heard().empty()) << "fed although nothing was done since";
}

TEST_F(ServiceNotifierTest, FeedsNoWatchdogOfAnotherProcess) {
  listen_as_systemd();
  setenv("WATCHDOG_USEC", "4000000", 1);
  setenv("WATCHDOG_PID", "1", 1);
  ServiceNotifier notifier;
  notifier.turn(1, 10.0);
  EXPECT_EQ(heard(), std::vector<std::string>{"READY=1"});
}

TEST_F(ServiceNotifierTest, WritesALineToTheDescriptorOfS6AndClosesIt) {
  std::array<int, 2> pipe_ends;
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  setenv("IGNIS_READY_FD", std::to_string(pipe_ends[1]).c_str(), 1);
  ServiceNotifier notifier;
  notifier.turn(1, 0.0);
  notifier.turn(2, 1.0);
  std::array<char, 8> buffer;
  EXPECT_EQ(read(pipe_ends[0], buffer.data(), buffer.size()), 1);
  EXPECT_EQ(buffer[0], '\n');
  EXPECT_EQ(read(pipe_ends[0], buffer.data(), buffer.size()), 0) << "the descriptor was left open";
  close(pipe_ends[0]);
}

TEST_F(ServiceNotifierTest, WithoutASupervisorNothingHappens) {
  ServiceNotifier notifier;
  EXPECT_NO_THROW(notifier.turn(1, 0.0));
  EXPECT_NO_THROW(notifier.status("OK"));
  for (const char* odd : {"1", "x", "-3", "7x", ""}) {
    setenv("IGNIS_READY_FD", odd, 1);
    ServiceNotifier other;
    EXPECT_NO_THROW(other.turn(1, 0.0)) << odd;
  }
}

}  // namespace
}  // namespace ignis::runtime
