// SPDX-License-Identifier: Apache-2.0
#include "drivers/mode_command.h"

#include <gtest/gtest.h>

namespace ignis::l1 {
namespace {

/// A sensor that obeys the `obeys_after`-th command and then needs 300 ms.
struct Outcome {
  ModeCommand::Step step = ModeCommand::Step::kWait;
  int sent = 0;
  double seconds = 0.0;
};

Outcome converse(WorkingMode wanted, bool running, int obeys_after, bool imu_runs = true) {
  StreamCounters counters;
  Utime now = 5'000'000;
  const Utime began = now;
  ModeCommand command(wanted, counters, now);
  std::optional<Utime> obeyed;
  Outcome outcome;
  while (now - began < 30'000'000) {
    now += 20'000;
    if (imu_runs) counters.framing.frames += 5;
    if (obeyed && now - *obeyed > 300'000) running = wanted == WorkingMode::kNormal;
    if (running) counters.pairing.paired += 4;
    outcome.step = command.step(counters, now);
    if (outcome.step == ModeCommand::Step::kSend && command.sent() == obeys_after) obeyed = now;
    if (outcome.step == ModeCommand::Step::kConfirmed || outcome.step == ModeCommand::Step::kFailed) break;
  }
  outcome.sent = command.sent();
  outcome.seconds = static_cast<double>(now - began) * 1e-6;
  return outcome;
}

TEST(ModeCommand, RepeatsUntilTheSensorObeys) {
  const Outcome standby = converse(WorkingMode::kStandby, true, 4);
  EXPECT_EQ(standby.step, ModeCommand::Step::kConfirmed);
  EXPECT_GE(standby.sent, 4);
  EXPECT_NEAR(standby.seconds, 0.3 + 0.3 + 1.0, 0.3);
  const Outcome normal = converse(WorkingMode::kNormal, false, 3);
  EXPECT_EQ(normal.step, ModeCommand::Step::kConfirmed);
  EXPECT_GE(normal.sent, 3);
}

TEST(ModeCommand, SendsAtLeastOnceAlsoToASensorThatIsThereAlready) {
  EXPECT_GE(converse(WorkingMode::kNormal, true, 1000).sent, 1);
  EXPECT_EQ(converse(WorkingMode::kNormal, true, 1000).step, ModeCommand::Step::kConfirmed);
}

TEST(ModeCommand, GivesUpOnASensorThatDoesNotObey) {
  const Outcome outcome = converse(WorkingMode::kStandby, true, 1000);
  EXPECT_EQ(outcome.step, ModeCommand::Step::kFailed);
  EXPECT_NEAR(outcome.seconds, 10.0, 0.2);
  EXPECT_NEAR(outcome.sent, 100, 20);
}

TEST(ModeCommand, DoesNotTakeADeadLineForStandby) {
  EXPECT_EQ(converse(WorkingMode::kStandby, false, 1, false).step, ModeCommand::Step::kFailed);
}

}  // namespace
}  // namespace ignis::l1
