// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/imu_buffer.h"

#include <gtest/gtest.h>

#include <limits>

namespace ignis {
namespace {

ImuSample at(Utime utime) {
  ImuSample sample;
  sample.utime = utime;
  return sample;
}

TEST(ImuBuffer, CountsEachFaultAndKeepsTheSampleOut) {
  ImuBuffer buffer;
  EXPECT_EQ(buffer.add(at(1000)), ImuFault::kNone);
  ImuSample bad = at(2000);
  bad.accel.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(buffer.add(bad), ImuFault::kNotFinite);
  bad.accel.x() = 1e24;
  EXPECT_EQ(buffer.add(bad), ImuFault::kImplausible);
  EXPECT_EQ(buffer.add(at(1000)), ImuFault::kDuplicate);
  EXPECT_EQ(buffer.add(at(500)), ImuFault::kLate);
  EXPECT_EQ(buffer.samples().size(), 1U);
  EXPECT_EQ(buffer.counters().accepted, 1);
  EXPECT_EQ(buffer.counters().not_finite, 1);
  EXPECT_EQ(buffer.counters().implausible, 1);
  EXPECT_EQ(buffer.counters().duplicate, 1);
  EXPECT_EQ(buffer.counters().late, 1);
}

TEST(ImuBuffer, OneStampFarAheadDoesNotBlockTheStream) {
  ImuBuffer buffer;
  Utime now = 0;
  for (int i = 0; i < 40; ++i) (void)buffer.add(at(now += 4000));
  EXPECT_EQ(buffer.add(at(now + 3'600'000'000)), ImuFault::kLeap);
  EXPECT_EQ(buffer.add(at(now += 4000)), ImuFault::kNone);
  EXPECT_EQ(buffer.counters().leaps, 1);
  EXPECT_EQ(buffer.newest(), now);
}

TEST(Fault_F9, AFirstStampOfTheFarFutureGivesWay) {
  ImuBuffer buffer;
  EXPECT_EQ(buffer.add(at(3'600'000'000)), ImuFault::kNone);
  EXPECT_EQ(buffer.add(at(4000)), ImuFault::kNone);
  EXPECT_EQ(buffer.add(at(3'600'000'000)), ImuFault::kLeap);
  EXPECT_EQ(buffer.add(at(8000)), ImuFault::kNone);
  EXPECT_EQ(buffer.samples().size(), 2U);
  EXPECT_EQ(buffer.newest(), 8000);
}

TEST(ImuBuffer, TakesALongGapOnceTheStreamCarriesOnBeyondIt) {
  ImuBuffer buffer;
  Utime now = 0;
  for (int i = 0; i < 40; ++i) (void)buffer.add(at(now += 4000));
  now += 5'000'000;
  EXPECT_EQ(buffer.add(at(now)), ImuFault::kLeap);
  EXPECT_EQ(buffer.add(at(now + 4000)), ImuFault::kNone);
  EXPECT_TRUE(buffer.gap_before(40));
}

TEST(ImuBuffer, LearnsThePeriodFromTheData) {
  for (const Utime period : {4'000, 10'000, 100'000}) {
    ImuBuffer buffer;
    Utime now = 0;
    for (int i = 0; i < 40; ++i) (void)buffer.add(at(now += period));
    (void)buffer.add(at(now += 2 * period));
    EXPECT_FALSE(buffer.gap_before(40)) << period;
    (void)buffer.add(at(now += 4 * period));
    EXPECT_TRUE(buffer.gap_before(41)) << period;
    EXPECT_NEAR(buffer.periods_before(41), 4.0, 1e-9);
    EXPECT_EQ(buffer.counters().gaps, 1);
  }
}

TEST(ImuBuffer, ForgetsOldSamplesButKeepsOneBeforeTheInstant) {
  ImuBuffer buffer;
  for (int i = 0; i < 1000; ++i) (void)buffer.add(at(1000 * i));
  buffer.forget_before(600'500);
  EXPECT_EQ(buffer.samples().front().utime, 600'000);
  EXPECT_EQ(buffer.newest(), 999'000);
  EXPECT_NEAR(buffer.periods_before(1), 1.0, 1e-9);
}

}  // namespace
}  // namespace ignis
