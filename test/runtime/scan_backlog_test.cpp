// SPDX-License-Identifier: Apache-2.0
#include "lio_frontend/scan_backlog.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace ignis {
namespace {

constexpr double kMost_s = 4.0;
constexpr Utime kPeriod = 50'000;  // [us] of an L1

Scan scan_until(Utime end, Utime period) {
  Scan scan;
  scan.utime = end - period;
  scan.duration_us = static_cast<std::int32_t>(period);
  return scan;
}

/// A LiDAR, a queue, and a computer that takes some seconds for each scan that it does not leave out.
class Computer {
 public:
  void stand_still(double seconds) { now_ += to_micros(seconds); }

  /// Handles all scans that end before `until` [s], each in `work_s`.
  void run(double until, double work_s) {
    while ((handled_ + 1) * kPeriod <= to_micros(until)) {
      const Utime end = ++handled_ * kPeriod;
      now_ = std::max(now_, end);
      const std::int64_t waiting = now_ / kPeriod - handled_;
      longest_wait_s = std::max(longest_wait_s, seconds_between(end, now_));
      if (backlog.leaves_out(scan_until(end, kPeriod), static_cast<double>(waiting))) continue;
      used.push_back(end);
      now_ += to_micros(work_s);
    }
  }

  ScanBacklog backlog{kMost_s};
  std::vector<Utime> used;  ///< ends of the scans [us]
  double longest_wait_s = 0.0;

 private:
  Utime now_ = 0;
  std::int64_t handled_ = 0;
};

double longest_hole_s(const std::vector<Utime>& ends) {
  double longest = 0.0;
  for (std::size_t i = 1; i < ends.size(); ++i) longest = std::max(longest, seconds_between(ends[i - 1], ends[i]));
  return longest;
}

TEST(Fault_B3, AHiccupThatTheQueueCanHoldCostsNoScan) {
  Computer computer;
  computer.run(10.0, 0.01);
  computer.stand_still(3.9);
  computer.run(30.0, 0.01);
  EXPECT_EQ(computer.backlog.left_out(), 0);
  EXPECT_FALSE(computer.backlog.is_behind());
}

TEST(Fault_B3, AfterALongerOneTheOldestScansGoAndEveryFifthHoldsThePose) {
  Computer computer;
  computer.run(10.0, 0.01);
  computer.stand_still(6.0);
  computer.run(17.0, 0.01);
  EXPECT_TRUE(computer.backlog.is_behind());
  EXPECT_GT(computer.backlog.left_out(), 60);
  EXPECT_LE(longest_hole_s(computer.used), 5.01 * 1e-6 * kPeriod);
  EXPECT_EQ(computer.used.back(), 340 * kPeriod);
  const std::int64_t left_out = computer.backlog.left_out();
  computer.run(30.0, 0.01);
  EXPECT_EQ(computer.backlog.left_out(), left_out) << "in time again";
  EXPECT_FALSE(computer.backlog.is_behind());
}

TEST(Fault_B3, AComputerThatIsAlwaysTooSlowIsNeverFarBehindOnceItWas) {
  for (const double work_s : {0.06, 0.1, 0.3, 1.0}) {
    Computer computer;
    computer.run(120.0, work_s);
    computer.longest_wait_s = 0.0;
    computer.used.clear();
    computer.run(200.0, work_s);
    EXPECT_TRUE(computer.backlog.is_behind()) << work_s;
    EXPECT_LE(computer.longest_wait_s, 0.4 + work_s) << work_s;
    EXPECT_LE(longest_hole_s(computer.used), 2.0 * work_s + 0.1) << work_s;
  }
}

TEST(Fault_B3, OneThatTakesMoreThanTheQueueHoldsForEachScanCatchesUpAsWell) {
  Computer computer;
  computer.run(600.0, 2.0);
  EXPECT_LE(computer.longest_wait_s, 10.0) << "170 where every fifth is kept whatever waits";
  computer.longest_wait_s = 0.0;
  computer.run(700.0, 2.0);
  EXPECT_LE(computer.longest_wait_s, 2.4);
}

TEST(Fault_B3, AHiccupOfOneThatIsBehindAlreadyIsCaughtUpWithTheSameWay) {
  Computer computer;
  computer.run(60.0, 0.1);
  ASSERT_TRUE(computer.backlog.is_behind());
  computer.stand_still(8.0);
  computer.used = {computer.used.back()};
  computer.run(90.0, 0.1);
  EXPECT_LE(longest_hole_s(computer.used), 5.01 * 1e-6 * kPeriod);
  computer.longest_wait_s = 0.0;
  computer.run(100.0, 0.1);
  EXPECT_LE(computer.longest_wait_s, 0.5);
}

TEST(ScanBacklog, GoesByTheSensorsPaceAndIsNotMisledByAClockSetBack) {
  constexpr Utime kSpinning = 100'000;  // [us]
  ScanBacklog backlog{kMost_s};
  Utime end = 60'000'000;
  EXPECT_FALSE(backlog.leaves_out(scan_until(end, kSpinning), 39)) << "of 10 Hz: 3.9 s";
  EXPECT_FALSE(backlog.leaves_out(scan_until(end, kPeriod), 79));
  EXPECT_FALSE(backlog.leaves_out(scan_until(end, 0), 39)) << "of one instant";
  EXPECT_TRUE(backlog.leaves_out(scan_until(end, kSpinning), 41));
  ASSERT_TRUE(backlog.is_behind());
  end = 1'000'000;  // the sensor was restarted
  for (int i = 0; i < 102; ++i) EXPECT_FALSE(backlog.leaves_out(scan_until(end += kSpinning, kSpinning), 0));
  EXPECT_FALSE(backlog.is_behind());
}

}  // namespace
}  // namespace ignis
