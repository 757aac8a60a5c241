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

TEST(BusAddress, IsNothingForOtherBuses) {
  EXPECT_FALSE(BusAddress::parse("memq://"));
  EXPECT_FALSE(BusAddress::parse("udpm://239.255.76.67:99999?ttl=0"));
}

TEST(BusSocket, IsNothingWhereNobodyListens) { EXPECT_FALSE(BusSocket::guard({.port = 1, .stays_home = true})); }

}  // namespace
}  // namespace ignis::runtime
