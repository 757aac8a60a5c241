// SPDX-License-Identifier: Apache-2.0
#include "runtime/bus_filter.h"

#include <array>
#include <string>
#include <string_view>
#include <system_error>

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace ignis::runtime {
namespace {

using namespace std::string_literals;

/// A UDP socket on the loopback interface; it neither waits nor shares its port.
class Socket {
 public:
  Socket() : descriptor_(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address_;
    if (bind(descriptor_, generic(), length) != 0 || getsockname(descriptor_, generic(), &length) != 0) {
      throw std::system_error(errno, std::system_category());
    }
  }
  ~Socket() { close(descriptor_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  void send(std::string_view datagram, Socket& to) {
    ASSERT_EQ(sendto(descriptor_, datagram.data(), datagram.size(), 0, to.generic(), sizeof to.address_),
              static_cast<ssize_t>(datagram.size()));
  }

  /// All that has arrived, in one text.
  [[nodiscard]] std::string received() const {
    std::string all;
    std::array<char, 1000> buffer{};
    for (ssize_t size = 0; (size = recv(descriptor_, buffer.data(), buffer.size(), 0)) >= 0;) {
      all.append(buffer.data(), static_cast<std::size_t>(size));
    }
    return all;
  }

  [[nodiscard]] int descriptor() const { return descriptor_; }
  [[nodiscard]] UdpAddress address() const { return {INADDR_LOOPBACK, ntohs(address_.sin_port)}; }

 private:
  sockaddr* generic() { return reinterpret_cast<sockaddr*>(&address_); }

  int descriptor_;
  sockaddr_in address_{};
};

std::string message(const std::string& channel, const std::string& body) {
  return "LC02\0\0\0\7"s + channel + '\0' + body;
}

const std::string kImu = message("LIO_IMU", "body");
const std::string kHealth = message("HEALTH", "body");

TEST(BusFilter, TakesWholeMessagesAndNothingElse) {
  Socket bus;
  Socket sender;
  BusFilter{}.attach(bus.descriptor());
  sender.send(kImu, bus);
  sender.send("LC03\0\0\0\7LIO_IMU\0body"s, bus);
  sender.send("LC02\0\0\0\7"s, bus);
  sender.send(message("A", ""), bus);
  EXPECT_EQ(bus.received(), kImu + message("A", ""));
}

TEST(BusFilter, TakesHealthAloneWhenThatIsAskedFor) {
  Socket bus;
  Socket sender;
  BusFilter{.health_only = true}.attach(bus.descriptor());
  for (const std::string& channel : {"LIO_IMU"s, "HEALTHY"s, "HEAT"s, "HEALTH"s, "A"s}) {
    sender.send(message(channel, "body"), bus);
  }
  EXPECT_EQ(bus.received(), kHealth);
}

TEST(Fault_B7, WhoIsNotListenedToIsHeardOnlyWithItsHealth) {
  Socket bus;
  Socket first;
  Socket second;
  Socket third;
  BusFilter{.unheard = {second.address(), third.address()}}.attach(bus.descriptor());
  for (Socket* sender : {&first, &second, &third}) {
    sender->send(kImu, bus);
    sender->send(kHealth, bus);
  }
  EXPECT_EQ(bus.received(), kImu + kHealth + kHealth + kHealth);
  BusFilter{}.attach(bus.descriptor());
  second.send(kImu, bus);
  EXPECT_EQ(bus.received(), kImu) << "the filter before is gone";
}

TEST(BusFilter, SaysThatTheKernelRefusesIt) { EXPECT_THROW(BusFilter{}.attach(-1), std::system_error); }

}  // namespace
}  // namespace ignis::runtime
