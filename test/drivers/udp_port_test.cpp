// SPDX-License-Identifier: Apache-2.0
#include "drivers/udp_port.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <format>
#include <thread>

#include <gtest/gtest.h>

#include "drivers/l1_samples.h"

namespace ignis::l1 {
namespace {

using samples::Bytes;

/// A sensor's board on the loopback: sends to one address, and hears answers.
class Board {
 public:
  explicit Board(const sockaddr_in& host) : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {
    EXPECT_EQ(connect(fd_, reinterpret_cast<const sockaddr*>(&host), sizeof(host)), 0);
  }
  ~Board() { close(fd_); }
  void send(const Bytes& bytes) const { EXPECT_EQ(::send(fd_, bytes.data(), bytes.size(), 0), std::ssize(bytes)); }
  [[nodiscard]] Bytes hear() const {
    Bytes bytes(2000);
    const ssize_t count = recv(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT);
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    return bytes;
  }

 private:
  int fd_;
};

/// An address on the loopback that nobody uses at the moment.
sockaddr_in free_address() {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  socklen_t size = sizeof(address);
  getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  close(fd);
  return address;
}

Bytes read_one(UdpPort& port, int timeout_ms = 500) {
  Bytes bytes(2000);
  bytes.resize(port.read(bytes, timeout_ms));
  return bytes;
}

TEST(UdpPort, CarriesDatagramsBothWays) {
  const sockaddr_in address = free_address();
  UdpPort port(address);
  const Board board(address);
  const Bytes question = samples::from_hex("00 fd 0a 0d ff");
  const Bytes answer = samples::from_hex("01 02");
  port.write(answer);  // nobody there yet
  board.send(question);
  EXPECT_EQ(read_one(port), question);
  EXPECT_TRUE(board.hear().empty());
  port.write(answer);
  EXPECT_EQ(board.hear(), answer);
  EXPECT_TRUE(read_one(port, 10).empty());
}

TEST(UdpPort, RefusesStrangersWhileTheSensorSends) {
  const sockaddr_in address = free_address();
  UdpPort port(address);
  const Board board(address);
  const Board stranger(address);
  board.send(samples::from_hex("01"));
  EXPECT_EQ(read_one(port).size(), 1U);
  stranger.send(samples::from_hex("02 03"));
  EXPECT_TRUE(read_one(port).empty());
  EXPECT_EQ(port.refused(), 1);
  std::this_thread::sleep_for(std::chrono::milliseconds(1050));
  stranger.send(samples::from_hex("02 03"));  // the board came back under another port
  EXPECT_EQ(read_one(port).size(), 2U);
}

TEST(UdpPort, SurvivesABoardThatWentAway) {
  const sockaddr_in address = free_address();
  UdpPort port(address);
  {
    const Board board(address);
    board.send(samples::from_hex("01"));
    EXPECT_EQ(read_one(port).size(), 1U);
  }
  port.write(samples::from_hex("05"));  // comes back as "port unreachable"
  EXPECT_TRUE(read_one(port, 20).empty());
}

TEST(UdpPort, SaysThatItsAddressIsTakenOrForeign) {
  const sockaddr_in address = free_address();
  const UdpPort holder(address);
  try {
    const UdpPort second(address);
    FAIL() << "two owners of one port";
  } catch (const LinkError& error) {
    EXPECT_NE(std::string(error.what()).find("in use"), std::string::npos) << error.what();
  }
  try {
    const UdpPort elsewhere(*parse_udp_address("udp://192.0.2.1:5000"));
    FAIL() << "an address of another machine";
  } catch (const LinkError& error) {
    EXPECT_NE(std::string(error.what()).find("not an address of this machine"), std::string::npos) << error.what();
  }
}

TEST(UdpAddress, IsReadStrictly) {
  const auto address = parse_udp_address("udp://10.10.10.100:5000");
  ASSERT_TRUE(address);
  EXPECT_EQ(ntohs(address->sin_port), 5000);
  EXPECT_EQ(ntohl(address->sin_addr.s_addr), 0x0A0A0A64U);
  for (const char* wrong : {"udp://", "udp://1.2.3.4", "udp://1.2.3.4:", "udp://1.2.3.4:0", "udp://1.2.3.4:70000",
                            "udp://1.2.3:5000", "udp://host:5000", "udp://1.2.3.4:5x", "/dev/ttyUSB0"}) {
    EXPECT_FALSE(parse_udp_address(wrong)) << wrong;
  }
}

TEST(ByteLink, IsChosenByThePortsName) {
  const sockaddr_in address = free_address();
  const auto link = open_link(std::format("udp://127.0.0.1:{}", ntohs(address.sin_port)), 2'000'000);
  const Board board(address);
  board.send(samples::from_hex("07"));
  Bytes bytes(16);
  EXPECT_EQ(link->read(bytes, 500), 1U);
  EXPECT_THROW((void)open_link("udp://nonsense", 2'000'000), LinkError);
  EXPECT_THROW((void)open_link("/dev/ttyIGNIS_does_not_exist", 2'000'000), LinkError);
}

}  // namespace
}  // namespace ignis::l1
