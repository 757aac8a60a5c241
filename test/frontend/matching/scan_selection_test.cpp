// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/scan_selection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace ignis {
namespace {

Scan random_scan(int points) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-4.0F, 4.0F);
  Scan scan;
  scan.utime = 77;
  scan.sequence = 5;
  scan.duration_us = 100'000;
  scan.missing_packets = 2;
  for (int i = 0; i < points; ++i) {
    scan.points.push_back({{place(random), place(random), place(random)}, static_cast<float>(i % 256), i});
  }
  return scan;
}

TEST(ScanSelection, DropsWhatIsNotFiniteOrOutOfRange) {
  const FrontendConfig config;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Scan scan;
  scan.points = {{{0.1F, 0.0F, 0.0F}, 0.0F, 0},
                 {{16.0F, 0.0F, 0.0F}, 0.0F, 0},
                 {{std::nanf(""), 0.0F, 1.0F}, 0.0F, 0},
                 {{kInfinity, 0.0F, 1.0F}, 0.0F, 0},
                 {{2.0F, 0.0F, 0.0F}, 9.0F, 3}};
  ScanSelector selector(config);
  const ScanSelection& selection = selector.select(scan);
  EXPECT_EQ(selection.in_range, 1);
  ASSERT_EQ(selection.scan.points.size(), 1U);
  EXPECT_EQ(selection.scan.points[0].intensity, 9.0F);
  EXPECT_EQ(selection.scan.points[0].dt_us, 3);
}

TEST(ScanSelection, KeepsTheHeadOfTheScanAndEveryPointOfASmallOne) {
  FrontendConfig config;
  config.scan_voxel_m = 1.0;
  const Scan scan = random_scan(config.max_scan_points);
  ScanSelector selector(config);
  const ScanSelection& selection = selector.select(scan);
  EXPECT_EQ(selection.scan.utime, 77);
  EXPECT_EQ(selection.scan.sequence, 5);
  EXPECT_EQ(selection.scan.duration_us, 100'000);
  EXPECT_EQ(selection.scan.missing_packets, 2);
  EXPECT_EQ(selection.scan.points.size(), static_cast<std::size_t>(selection.in_range));
}

TEST(ScanSelection, LeavesOneMeasuredPointPerVoxelOfALargeScan) {
  FrontendConfig config;
  config.scan_voxel_m = 1.0;
  const Scan scan = random_scan(50'000);
  ScanSelector selector(config);
  const ScanSelection& selection = selector.select(scan);
  EXPECT_GT(selection.in_range, 40'000);
  EXPECT_LE(selection.scan.points.size(), 8U * 8U * 8U);
  EXPECT_GT(selection.scan.points.size(), 400U);
  for (const ScanPoint& point : selection.scan.points) {
    EXPECT_EQ(point.position, scan.points[static_cast<std::size_t>(point.dt_us)].position) << "a point as measured";
  }
  config.scan_voxel_m = 0.0;
  EXPECT_EQ(ScanSelector(config).select(scan).scan.points.size(), static_cast<std::size_t>(selection.in_range));
}

TEST(ScanSelection, LooksAtABoundedNumberOfPointsFromAllOfALargeScan) {
  FrontendConfig config;
  const Scan scan = random_scan(1'600'000);
  ScanSelector selector(config);
  const ScanSelection& selection = selector.select(scan);
  EXPECT_EQ(selection.unread, 1'600'000 - 150'000);
  EXPECT_LE(selection.in_range + selection.unread, 1'600'000);
  EXPECT_EQ(selection.scan.points.size(), static_cast<std::size_t>(selection.in_range));
  for (std::size_t i = 1; i < selection.scan.points.size(); ++i) {
    ASSERT_LT(selection.scan.points[i].dt_us - selection.scan.points[i - 1].dt_us, 200) << "from all of the scan";
  }
  config.scan_voxel_m = 1.0;
  EXPECT_EQ(ScanSelector(config).select(scan).unread, 600'000) << "what is thinned at once costs less";
  EXPECT_EQ(ScanSelector(config).select(random_scan(262'144)).unread, 0);
}

}  // namespace
}  // namespace ignis
