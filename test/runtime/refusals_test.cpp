// SPDX-License-Identifier: Apache-2.0
#include "runtime/refusals.h"

#include <array>
#include <string>

#include <gtest/gtest.h>

#include "messages/length_check.h"

namespace ignis::runtime {
namespace {

/// An encoded imu_t.
std::vector<std::byte> encoded_imu() {
  const imu_t message{};
  std::vector<std::byte> data(static_cast<std::size_t>(message.getEncodedSize()));
  EXPECT_EQ(message.encode(data.data(), 0, static_cast<int>(data.size())), static_cast<int>(data.size()));
  return data;
}

TEST(Fault_B4, ForeignTypesAreNamedWithTheOneThatBelongsThere) {
  const std::vector<std::byte> imu = encoded_imu();
  EXPECT_EQ(Refusals::foreign_type(imu, imu_t::getHash()), "");
  EXPECT_EQ(Refusals::foreign_type(imu, scan_t::getHash()), "imu_t instead of scan_t");
  const std::array<std::byte, 8> stranger{};
  EXPECT_EQ(Refusals::foreign_type(stranger, imu_t::getHash()),
            "type 0x0000000000000000, which is none of ours instead of imu_t");
}

TEST(Refusals, AreLoggedAtPowersOfTwo) {
  Refusals refusals;
  std::string logged;
  for (int number = 1; number <= 20; ++number) {
    if (refusals.refused("bad", false, 0.0)) logged += std::to_string(number) + ' ';
  }
  EXPECT_EQ(logged, "1 2 4 8 16 ");
  EXPECT_EQ(refusals.count(), 20);
}

TEST(Refusals, AreToldWhileTheyAreNew) {
  Refusals refusals;
  EXPECT_EQ(refusals.trouble(0.0), "");
  refusals.refused("bad", false, 10.0);
  EXPECT_EQ(refusals.trouble(10.0 + Refusals::kTold_s), "refused 1 messages, the last one: bad");
  EXPECT_EQ(refusals.trouble(10.1 + Refusals::kTold_s), "");
}

TEST(Fault_B4, AChannelIsTakenWhenNothingElseComes) {
  Refusals refusals;
  refusals.taken(10.0);
  refusals.refused("imu_t instead of scan_t", true, 10.5);
  EXPECT_FALSE(refusals.is_taken_by_another(10.5)) << "the right ones come too";
  refusals.refused("imu_t instead of scan_t", true, 13.5);
  EXPECT_TRUE(refusals.is_taken_by_another(13.5));
  refusals.refused("its length is impossible", false, 13.6);
  EXPECT_FALSE(refusals.is_taken_by_another(13.6)) << "damage takes no channel";
}

}  // namespace
}  // namespace ignis::runtime
