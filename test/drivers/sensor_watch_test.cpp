// SPDX-License-Identifier: Apache-2.0
#include "drivers/sensor_watch.h"

#include <gtest/gtest.h>

namespace ignis::l1 {
namespace {

class SensorWatchTest : public ::testing::Test {
 protected:
  /// Looks every 50 ms for `seconds`, while the given streams run.
  SensorReport run(double seconds, bool imu, bool packets, const SensorHealth& health = {}) {
    SensorReport report;
    for (int i = 0; i < seconds * 20; ++i) {
      now_ += 50'000;
      if (imu) counters_.imu_published += 12;
      if (packets) counters_.pairing.paired += 9;
      if (imu || packets) counters_.framing.bytes += 5000;
      report = watch_.look(now_, "", counters_, health);
    }
    return report;
  }
  SensorReport run_on_garbage(double seconds) {
    SensorReport report;
    for (int i = 0; i < seconds * 20; ++i) {
      now_ += 50'000;
      counters_.framing.bytes += 1000;
      report = watch_.look(now_, "", counters_, {});
    }
    return report;
  }
  SensorWatch watch_{"/dev/ttyUSB7 at 2000000 baud"};
  DecoderCounters counters_;
  Utime now_ = 1'000'000'000;
};

TEST_F(SensorWatchTest, WaitsThenRuns) {
  EXPECT_EQ(run(0.5, false, false).severity, Severity::kDegraded);
  const SensorReport waiting = run(1.0, false, false);
  EXPECT_EQ(waiting.state, SensorState::kWaiting);
  EXPECT_EQ(waiting.severity, Severity::kFault);
  EXPECT_NE(waiting.text.find("/dev/ttyUSB7 at 2000000 baud"), std::string::npos) << waiting.text;
  const SensorReport report = run(1.2, true, true);
  EXPECT_EQ(report.state, SensorState::kRunning);
  EXPECT_EQ(report.severity, Severity::kOk);
}

TEST_F(SensorWatchTest, AsksForASecondOfGoodDataAfterTrouble) {
  (void)run(2.0, true, true);
  (void)run(0.5, false, true);
  const SensorReport recovering = run(0.8, true, true);
  EXPECT_EQ(recovering.severity, Severity::kDegraded);
  EXPECT_NE(recovering.text.find("no inertial data"), std::string::npos) << recovering.text;
  EXPECT_EQ(run(0.4, true, true).severity, Severity::kOk);
}

TEST_F(SensorWatchTest, NoticesAMissingStreamWithin300Milliseconds) {
  (void)run(2.0, true, true);
  SensorReport report = run(0.35, true, false);
  EXPECT_EQ(report.severity, Severity::kDegraded);
  EXPECT_EQ(report.state, SensorState::kRunning);
  report = run(1.0, true, false);
  EXPECT_EQ(report.state, SensorState::kStandby);
  (void)run(2.0, true, true);
  report = run(0.35, false, true);
  EXPECT_EQ(report.severity, Severity::kDegraded);
  EXPECT_EQ(report.text, "scans come, but no inertial data");
}

TEST_F(SensorWatchTest, CallsASensorThatStoppedSilentAndThenFaulty) {
  (void)run(2.0, true, true);
  const SensorReport early = run(0.5, false, false);
  EXPECT_EQ(early.state, SensorState::kSilent);
  EXPECT_EQ(early.severity, Severity::kDegraded);
  EXPECT_EQ(run(1.0, false, false).severity, Severity::kFault);
}

TEST_F(SensorWatchTest, CallsBytesWithoutFramesAFaultAndTellsHowMany) {
  const SensorReport report = run_on_garbage(1.5);
  EXPECT_EQ(report.severity, Severity::kFault);
  EXPECT_NE(report.text.find("30000 bytes"), std::string::npos) << report.text;
  EXPECT_NE(report.text.find("wrong speed"), std::string::npos) << report.text;
}

TEST_F(SensorWatchTest, ReportsFrozenAndImpossibleValues) {
  (void)run(2.0, true, true);
  EXPECT_EQ(run(0.05, true, true, {.equal_gyro_samples = 25, .equal_accel_samples = 25}).text,
            "inertial values are frozen");
  counters_.rejected_values += 50;
  const SensorReport report = run(0.05, true, true, {.rejected_in_a_row = 50, .rejected_field = "theta_angle"});
  EXPECT_EQ(report.severity, Severity::kFault);
  EXPECT_NE(report.text.find("theta_angle"), std::string::npos);
}

TEST_F(SensorWatchTest, ForgetsImpossibleValuesOfAMessageThatNoLongerComes) {
  (void)run(2.0, true, true);
  const SensorHealth health{.rejected_in_a_row = 60, .rejected_field = "theta_angle"};
  counters_.rejected_values += 60;
  EXPECT_EQ(run(0.05, true, false, health).severity, Severity::kFault);
  EXPECT_EQ(run(1.5, true, false, health).state, SensorState::kStandby);
}

TEST_F(SensorWatchTest, TellsAClosedPortFromASilentOne) {
  (void)run(2.0, true, true);
  const SensorReport report = watch_.look(now_, "no permission", counters_, {});
  EXPECT_EQ(report.state, SensorState::kDisconnected);
  EXPECT_EQ(report.severity, Severity::kFault);
  EXPECT_EQ(report.text, "/dev/ttyUSB7 at 2000000 baud: no permission; trying again");
}

}  // namespace
}  // namespace ignis::l1
