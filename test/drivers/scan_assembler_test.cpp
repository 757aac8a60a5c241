// SPDX-License-Identifier: Apache-2.0
#include "drivers/scan_assembler.h"

#include <gtest/gtest.h>

namespace ignis::l1 {
namespace {

const std::vector<BodyPoint> kTwoPoints = {{{1, 2, 3}, 10.0F, 0}, {{4, 5, 6}, 20.0F, 119}};

double time_of(std::int64_t count) { return 1e6 + static_cast<double>(count) * kScanPeriodUs; }

std::vector<Scan> run(ScanAssembler& assembler, const std::vector<std::int64_t>& counts) {
  std::vector<Scan> scans;
  for (const std::int64_t count : counts) {
    for (Scan& scan : assembler.add(count, time_of(count), kTwoPoints)) scans.push_back(std::move(scan));
  }
  return scans;
}

TEST(ScanAssembler, EndsAScanWithItsLastPlace) {
  ScanAssembler assembler(9);
  const auto scans = run(assembler, {9, 10, 11, 12, 13, 14, 15, 16, 17, 18});
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].points.size(), 18U);
  EXPECT_EQ(scans[0].missing_packets, 0);
  EXPECT_EQ(scans[0].utime, std::llround(time_of(9)));
}

TEST(ScanAssembler, GivesEachPointItsOwnInstant) {
  ScanAssembler assembler(2);
  const auto scans = run(assembler, {0, 1});
  ASSERT_EQ(scans.size(), 1U);
  const Scan& scan = scans[0];
  EXPECT_EQ(scan.points[0].dt_us, 0);
  EXPECT_NEAR(scan.points[1].dt_us, 119 * 1e6 / 43200.0, 1.0);
  EXPECT_NEAR(scan.points[2].dt_us, 1e6 / 180.0, 1.0);
  EXPECT_NEAR(scan.points[3].dt_us, 1e6 / 180.0 + 119 * 1e6 / 43200.0, 1.0);
  EXPECT_EQ(scan.duration_us, scan.points[3].dt_us);
  EXPECT_EQ(scan.points[1].position, Eigen::Vector3f(4, 5, 6));
}

TEST(ScanAssembler, CountsHolesAndNeverStretches) {
  ScanAssembler assembler(9);
  const auto scans = run(assembler, {0, 1, 2, /* 16 lost */ 19, 20, 26, 27});
  ASSERT_EQ(scans.size(), 2U);
  EXPECT_EQ(scans[0].missing_packets, 6);
  EXPECT_EQ(scans[1].missing_packets, 6);
  EXPECT_LT(scans[0].duration_us, 50'000);
  EXPECT_LT(scans[1].duration_us, 50'000);
  EXPECT_EQ(scans[1].sequence, 1);
}

TEST(ScanAssembler, DoesNotCountPlacesBeforeTheFirstPacketAsMissing) {
  ScanAssembler assembler(9);
  const auto scans = run(assembler, {4, 5, 6, 7, 8});
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].missing_packets, 0);
}

TEST(ScanAssembler, DoesNotCountPlacesAfterTheEndOfTheStreamAsMissing) {
  ScanAssembler assembler(9);
  EXPECT_TRUE(run(assembler, {0, 2}).empty());
  const auto scan = assembler.end();
  ASSERT_TRUE(scan);
  EXPECT_EQ(scan->missing_packets, 1);
  EXPECT_FALSE(assembler.end());
}

TEST(ScanAssembler, EndsAnOverdueScan) {
  ScanAssembler assembler(9);
  EXPECT_TRUE(run(assembler, {0, 1, 2}).empty());
  EXPECT_FALSE(assembler.end_if_overdue(time_of(9)));
  const auto scan = assembler.end_if_overdue(time_of(9) + 21'000.0);
  ASSERT_TRUE(scan);
  EXPECT_EQ(scan->missing_packets, 6);
  EXPECT_FALSE(assembler.end_if_overdue(time_of(20)));
}

TEST(ScanAssembler, KeepsTheTimeOfAScanWithoutPoints) {
  ScanAssembler assembler(1);
  const auto scans = assembler.add(5, time_of(5), {});
  ASSERT_EQ(scans.size(), 1U);
  EXPECT_EQ(scans[0].utime, std::llround(time_of(5)));
  EXPECT_EQ(scans[0].duration_us, 0);
}

}  // namespace
}  // namespace ignis::l1
