// SPDX-License-Identifier: Apache-2.0
#include "runtime/instance_lock.h"

#include <format>
#include <optional>

#include <gtest/gtest.h>
#include <unistd.h>

#include "runtime/application.h"
#include "runtime/bus_socket.h"

namespace ignis::runtime {
namespace {

/// A bus of this process alone: tests run side by side in one network namespace.
std::string bus(int number) { return std::format("udpm://239.255.76.{}:{}", number, 10'000 + getpid() % 50'000); }

TEST(Fault_B7, ASecondInstanceOnTheSameBusIsRefusedWithItsNameUntilTheFirstIsGone) {
  std::optional<InstanceLock> first(std::in_place, "l1_driver", bus(1) + "?ttl=0");
  try {
    const InstanceLock second("l1_driver", bus(1) + "?ttl=1&recv_buf_size=2097152");
    FAIL() << "the options of the URL make no other bus";
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("another l1_driver is on the bus " + bus(1)), std::string::npos);
    EXPECT_EQ(error.code(), kFailed);
  }
  first.reset();
  EXPECT_NO_THROW(InstanceLock("l1_driver", bus(1)));
}

TEST(Fault_B7, ASecondInstanceIsFoundHoweverItSpellsTheBus) {
  const std::string port = std::to_string(10'000 + getpid() % 50'000);
  const InstanceLock first("l1_driver", "udpm://239.255.76.67:" + port);
  EXPECT_THROW(InstanceLock("l1_driver", "udpm://239.255.76.67:" + port + "?ttl=0"), UserError);
  EXPECT_THROW(InstanceLock("l1_driver", "udpm://239.255.0x4c.67:" + port), UserError);
  EXPECT_EQ(BusAddress::parse("udpm://")->group, "239.255.76.67");
  const InstanceLock odd("l1_driver", "udpm://239.255.76.67:" + port + "x");
  EXPECT_THROW(InstanceLock("l1_driver", "udpm://239.255.76.67:" + port + "x"), UserError)
      << "read in its own way by LCM";
}

TEST(Fault_B7, OtherProcessesOtherBusesAndBusesWithinOneProcessAreNoSecondInstance) {
  const InstanceLock first("l1_driver", bus(1));
  EXPECT_NO_THROW(InstanceLock("lio_frontend", bus(1)));
  EXPECT_NO_THROW(InstanceLock("l1_driver", bus(2)));
  const InstanceLock inside("l1_driver", "memq://");
  EXPECT_NO_THROW(InstanceLock("l1_driver", "memq://"));
}

}  // namespace
}  // namespace ignis::runtime
