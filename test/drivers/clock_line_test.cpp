// SPDX-License-Identifier: Apache-2.0
#include "drivers/clock_line.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace ignis::l1 {
namespace {

constexpr double kPeriod = 4000.0;
constexpr double kWindow = 10e6;

/// A sensor clock against a host clock with one-sided delays: mostly short, sometimes long.
struct DelayedClock {
  double start;
  double rate;  ///< host time per nominal sensor time
  std::mt19937 random{7};
  std::exponential_distribution<double> short_delay{1.0 / 300.0};

  [[nodiscard]] double truth(int count) const { return start + count * kPeriod * rate; }
  double delay() { return short_delay(random) + (random() % 50 == 0 ? 15'000.0 : 0.0); }
};

TEST(ClockLine, FindsOffsetAndDriftBehindRandomDelays) {
  for (const double ppm : {-1000.0, 0.0, 60.0, 1000.0}) {
    DelayedClock clock{1.7e15, 1.0 - ppm * 1e-6};
    ClockLine line(kPeriod, kWindow, Bound::kUpper);
    for (int i = 0; i < 7500; ++i) {
      line.add(i, clock.truth(i) + clock.delay());
      if (i > 250) {
        ASSERT_NEAR(line.at(i), clock.truth(i), 100.0) << i;
      }
    }
    EXPECT_NEAR(line.drift_ppm(), ppm, 5.0);
    EXPECT_NEAR(line.jitter_us(), 208.0, 60.0);  // median of an exponential delay of mean 300 us
  }
}

TEST(ClockLine, NeverPutsTheLineBehindADatum) {
  DelayedClock clock{0.0, 1.0001};
  ClockLine line(kPeriod, kWindow, Bound::kUpper);
  for (int i = 0; i < 3000; ++i) {
    const double arrival = clock.truth(i) + clock.delay();
    line.add(i, arrival);
    ASSERT_LE(line.at(i), arrival + 1e-3);
  }
}

TEST(ClockLine, MirrorsForLowerBounds) {
  DelayedClock clock{5e6, 1.0};
  ClockLine upper(kPeriod, kWindow, Bound::kUpper);
  ClockLine lower(kPeriod, kWindow, Bound::kLower);
  for (int i = 0; i < 3000; ++i) {
    const double delay = clock.delay();
    upper.add(i, clock.truth(i) + delay);
    lower.add(i, clock.truth(i) - delay);
  }
  EXPECT_NEAR(upper.at(3000) - clock.truth(3000), clock.truth(3000) - lower.at(3000), 1e-3);
}

TEST(ClockLine, ForgetsDelaysOutsideItsWindow) {
  ClockLine line(kPeriod, 1e6, Bound::kUpper);
  for (int i = 0; i < 250; ++i) line.add(i, i * kPeriod);
  for (int i = 250; i < 1000; ++i) line.add(i, i * kPeriod + 3000.0);  // the path got longer
  EXPECT_NEAR(line.at(1000), 1000 * kPeriod + 3000.0, 10.0);
}

TEST(ClockLine, StartsAfreshWhenTheCounterLostItsMeaning) {
  ClockLine line(kPeriod, kWindow, Bound::kUpper);
  for (int i = 0; i < 500; ++i) line.add(i, i * kPeriod);
  line.add(500, 500 * kPeriod - 1e6);
  EXPECT_EQ(line.restarts(), 1);
  EXPECT_NEAR(line.at(501), 501 * kPeriod - 1e6, 1e-6);
  for (int i = 501; i < 1000; ++i) line.add(i, i * kPeriod + 1e6);
  EXPECT_EQ(line.restarts(), 2);
  EXPECT_NEAR(line.at(1000), 1000 * kPeriod + 1e6, 1e-6);
}

TEST(ClockLine, RidesOutAStallOfTheHost) {
  ClockLine line(kPeriod, kWindow, Bound::kUpper);
  for (int i = 0; i < 500; ++i) line.add(i, i * kPeriod);
  for (int i = 500; i < 700; ++i) line.add(i, 700 * kPeriod);  // all of 0.8 s in one read
  for (int i = 700; i < 1000; ++i) line.add(i, i * kPeriod);
  EXPECT_EQ(line.restarts(), 0);
  EXPECT_NEAR(line.at(1000), 1000 * kPeriod, 1.0);
}

TEST(ClockLine, RidesOutAQueueThatFillsAndDrains) {
  for (const double drained_at : {20.0, 5.0, 2.0}) {  // times as fast as it fills
    ClockLine line(kPeriod, kWindow, Bound::kUpper);
    for (int i = 0; i < 500; ++i) line.add(i, i * kPeriod);
    double lateness = 2e6;
    for (int i = 500; i < 4000; ++i) {
      line.add(i, i * kPeriod + lateness);
      lateness = std::max(0.0, lateness - (1.0 - 1.0 / drained_at) * kPeriod);
      ASSERT_NEAR(line.at(i), i * kPeriod, 1.0) << i;
    }
    EXPECT_EQ(line.restarts(), 0);
  }
}

TEST(ClockLine, RidesOutAReaderThatFallsBehindAndCatchesUp) {
  ClockLine line(kPeriod, kWindow, Bound::kUpper);
  for (int i = 0; i < 500; ++i) line.add(i, i * kPeriod);
  for (int i = 500; i < 1000; ++i) line.add(i, i * kPeriod + 0.3 * (i - 500) * kPeriod);
  for (int i = 1000; i < 1500; ++i) line.add(i, i * kPeriod + 0.3 * (1500 - i) * kPeriod);
  EXPECT_EQ(line.restarts(), 0);
  EXPECT_NEAR(line.at(1500), 1500 * kPeriod, 1.0);
}

TEST(ClockLine, StartsAfreshBehindJitterToo) {
  DelayedClock clock{0.0, 1.0};
  ClockLine line(kPeriod, kWindow, Bound::kUpper);
  for (int i = 0; i < 500; ++i) line.add(i, clock.truth(i) + clock.delay());
  for (int i = 500; i < 1000; ++i) line.add(i, clock.truth(i) + 1e6 + 5.0 * clock.delay());
  EXPECT_EQ(line.restarts(), 1);
  EXPECT_NEAR(line.at(1000), clock.truth(1000) + 1e6, 100.0);
}

}  // namespace
}  // namespace ignis::l1
