// SPDX-License-Identifier: Apache-2.0
#include "runtime/bus_socket.h"

#include <gtest/gtest.h>

namespace ignis::runtime {
namespace {

TEST(BusAddress, ReadsPortAndReachFromTheUrl) {
  const auto home = BusAddress::parse("udpm://239.255.76.67:7668?ttl=0&recv_buf_size=2097152");
  ASSERT_TRUE(home);
  EXPECT_EQ(home->port, 7668);
  EXPECT_TRUE(home->stays_home);
  const auto far = BusAddress::parse("udpm://239.255.76.67:7667?recv_buf_size=2097152&ttl=1");
  ASSERT_TRUE(far);
  EXPECT_FALSE(far->stays_home);
  EXPECT_EQ(BusAddress::parse("udpm://239.255.76.67?ttl=0")->port, 7667) << "LCM's own default";
}

TEST(BusAddress, ReadsTheReceiveBufferFromTheUrl) {
  EXPECT_EQ(BusAddress::parse("udpm://239.255.76.67:7668?ttl=0&recv_buf_size=2097152")->receive_buffer, 2097152);
  EXPECT_EQ(BusAddress::parse("udpm://239.255.76.67:7668?recv_buf_size=5&ttl=0")->receive_buffer, 5);
  EXPECT_EQ(BusAddress::parse("udpm://239.255.76.67:7668?ttl=0")->receive_buffer, 0);
}

TEST(Fault_B3, AReceiveBufferThatIsTooSmallIsToldWithWhatWasAskedFor) {
  const BusAddress address{.receive_buffer = 2097152};
  EXPECT_EQ(address.shortage(2097152), "");
  const std::string told = address.shortage(212992);
  EXPECT_NE(told.find("212992 of 2097152 bytes"), std::string::npos) << told;
  EXPECT_NE(told.find("rmem_max"), std::string::npos) << told;
  EXPECT_EQ(BusAddress{}.shortage(212992), "") << "nothing was asked for";
}

TEST(BusAddress, IsNothingForOtherBuses) {
  EXPECT_FALSE(BusAddress::parse("memq://"));
  EXPECT_FALSE(BusAddress::parse("udpm://239.255.76.67:99999?ttl=0"));
}

TEST(BusSocket, IsNothingWhereNobodyListens) { EXPECT_FALSE(BusSocket::guard({.port = 1, .stays_home = true})); }

}  // namespace
}  // namespace ignis::runtime
