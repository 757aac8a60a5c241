// SPDX-License-Identifier: Apache-2.0
#include "drivers/sensor_clock.h"

#include <gtest/gtest.h>

namespace ignis::l1 {
namespace {

TEST(SteadyStamps, FollowTheTargetWithoutJitter) {
  SteadyStamps stamps(4000.0);
  EXPECT_DOUBLE_EQ(stamps.stamp(10, 1e6), 1e6);
  EXPECT_DOUBLE_EQ(stamps.stamp(11, 1e6 + 4050.0), 1e6 + 4050.0);    // within 2 %
  EXPECT_DOUBLE_EQ(stamps.stamp(12, 1e6 + 12'000.0), 1e6 + 8130.0);  // bent by 2 % of 4 ms at most
}

TEST(SteadyStamps, NeverGoBack) {
  SteadyStamps stamps(4000.0);
  const double first = stamps.stamp(0, 1e9);
  const double second = stamps.stamp(1, 1e9 - 3'600e6);
  EXPECT_GT(second, first);
  EXPECT_GT(stamps.stamp(2, 1e9 - 3'600e6), second);
}

TEST(SteadyStamps, JumpForwardsToAFarTarget) {
  SteadyStamps stamps(4000.0);
  (void)stamps.stamp(0, 0.0);
  EXPECT_DOUBLE_EQ(stamps.stamp(1, 1e6), 1e6);
}

TEST(SensorClock, TakesLatenciesOffTheArrivals) {
  DriverConfig config;
  config.scan_latency_ms = 3.0;
  config.imu_latency_ms = 1.0;
  SensorClock clock(config);
  EXPECT_TRUE(clock.ready());
  clock.on_auxiliary(5, 1'000'000.0);
  clock.on_imu(9, 2'000'000.0);
  EXPECT_DOUBLE_EQ(clock.packet_time(5), 997'000.0);
  EXPECT_DOUBLE_EQ(clock.imu_time(9), 1'999'000.0);
}

TEST(SensorClock, PlacesPacketsOfACaptureByTheirCounter) {
  DriverConfig config;
  config.time_source = "counters";
  config.start_time_s = 100.0;
  SensorClock clock(config);
  clock.on_auxiliary(180, 0.0);
  EXPECT_NEAR(clock.packet_time(180), 101e6, 1e-3);
}

}  // namespace
}  // namespace ignis::l1
