// SPDX-License-Identifier: Apache-2.0
#include "drivers/sensor_watch.h"

#include <gtest/gtest.h>

namespace ignis::l1 {
namespace {

/// Looks every 50 ms for `seconds`, while the given streams run.
SensorReport watch(SensorWatch& watch, DecoderCounters& counters, Utime& now, double seconds, bool imu, bool packets,
                   const SensorHealth& health = {}) {
  SensorReport report;
  for (int i = 0; i < seconds * 20; ++i) {
    now += 50'000;
    if (imu) counters.imu_published += 12;
    if (packets) counters.pairing.paired += 9;
    report = watch.look(now, true, counters, health);
  }
  return report;
}

class SensorWatchTest : public ::testing::Test {
 protected:
  SensorReport run(double seconds, bool imu, bool packets, const SensorHealth& health = {}) {
    return watch(watch_, counters_, now_, seconds, imu, packets, health);
  }
  SensorWatch watch_;
  DecoderCounters counters_;
  Utime now_ = 1'000'000'000;
};

TEST_F(SensorWatchTest, WaitsThenRuns) {
  EXPECT_EQ(run(2.0, false, false).state, SensorState::kWaiting);
  const SensorReport report = run(1.0, true, true);
  EXPECT_EQ(report.state, SensorState::kRunning);
  EXPECT_FALSE(report.degraded);
}

TEST_F(SensorWatchTest, NoticesAMissingStreamWithin300Milliseconds) {
  (void)run(1.0, true, true);
  SensorReport report = run(0.35, true, false);
  EXPECT_TRUE(report.degraded);
  EXPECT_EQ(report.state, SensorState::kRunning);
  report = run(1.0, true, false);
  EXPECT_EQ(report.state, SensorState::kStandby);
  (void)run(1.0, true, true);
  report = run(0.35, false, true);
  EXPECT_TRUE(report.degraded);
  EXPECT_EQ(report.text, "scans come, but no inertial data");
}

TEST_F(SensorWatchTest, CallsASensorThatStoppedSilent) {
  (void)run(1.0, true, true);
  EXPECT_EQ(run(0.5, false, false).state, SensorState::kSilent);
  EXPECT_FALSE(run(0.5, true, true).degraded);
}

TEST_F(SensorWatchTest, ReportsFrozenAndImpossibleValues) {
  EXPECT_TRUE(run(1.0, true, true, {.rejected_in_a_row = 0, .rejected_field = "", .equal_imu_samples = 25}).degraded);
  const SensorReport report =
      run(1.0, true, true, {.rejected_in_a_row = 50, .rejected_field = "theta_angle", .equal_imu_samples = 0});
  EXPECT_TRUE(report.degraded);
  EXPECT_NE(report.text.find("theta_angle"), std::string::npos);
}

TEST_F(SensorWatchTest, TellsAClosedPortFromASilentOne) {
  (void)run(1.0, true, true);
  EXPECT_EQ(watch_.look(now_, false, counters_, {}).state, SensorState::kDisconnected);
}

}  // namespace
}  // namespace ignis::l1
