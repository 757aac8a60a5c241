// SPDX-License-Identifier: Apache-2.0
#include "drivers/scan_geometry.h"

#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "drivers/frame_parser.h"
#include "drivers/l1_samples.h"

namespace ignis::l1 {
namespace {

/// The vendor's library accumulates angles in single precision.
constexpr double kVendorTolerance = 0.0002;

DriverConfig vendor_config() {
  DriverConfig config;
  config.range_min_m = 0.0;
  config.range_max_m = 50.0;
  return config;
}

TEST(ScanGeometry, GivesTheVendorsPointsForTheProtocolSheetsScan) {
  const auto points = points_of({samples::auxiliary(300), samples::distance(300)}, vendor_config());
  ASSERT_EQ(points.size(), 120U);
  EXPECT_LT((points[0].position - Eigen::Vector3d(-1.997944, 0.086189, 0.051042)).norm(), kVendorTolerance);
  EXPECT_LT((points[59].position - Eigen::Vector3d(-0.044886, -0.054155, 2.043076)).norm(), kVendorTolerance);
  EXPECT_LT((points[119].position - Eigen::Vector3d(1.993165, 0.156368, 0.090286)).norm(), kVendorTolerance);
  EXPECT_EQ(points[59].index, 59);
  EXPECT_EQ(points[0].intensity, 100.0F);
}

TEST(ScanGeometry, AgreesWithTheVendorOnEveryPointOfTheGoldenStream) {
  FrameParser parser;
  PacketPairer pairer;
  parser.feed(samples::read_bytes("golden_clean.bin"), 0);
  std::map<std::pair<int, int>, SensorPoint> ours;
  int scan = 0;
  while (const auto frame = parser.next()) {
    pairer.on_frame();
    if (frame->id == kAuxiliaryId) pairer.on_auxiliary(decode_auxiliary(frame->payload), 0.0);
    if (frame->id != kDistanceId) continue;
    const auto packet = pairer.on_distance(decode_distance(frame->payload), 0.0);
    ASSERT_TRUE(packet);
    for (const SensorPoint& point : points_of(*packet, vendor_config())) ours[{scan, point.index}] = point;
    ++scan;
  }
  EXPECT_EQ(scan, 36);
  const auto rows = samples::read_rows("golden_clean_points.csv");
  ASSERT_EQ(rows.size(), 4169U);
  EXPECT_EQ(ours.size(), rows.size());
  double worst = 0.0;
  for (const auto& row : rows) {
    const auto found = ours.find({std::stoi(row[0]), std::stoi(row[1])});
    ASSERT_NE(found, ours.end()) << "scan " << row[0] << " point " << row[1];
    const Eigen::Vector3d theirs(std::stod(row[2]), std::stod(row[3]), std::stod(row[4]));
    worst = std::max(worst, (found->second.position - theirs).norm());
    EXPECT_EQ(found->second.intensity, std::stof(row[5]));
  }
  EXPECT_LT(worst, kVendorTolerance);
  RecordProperty("worst_um", static_cast<int>(worst * 1e6));
}

TEST(ScanGeometry, KeepsToTheRangeLimitsAsTheVendorRoundsThem) {
  Distance ranges = samples::distance(1);
  ranges.ranges_mm.fill(0);
  const std::uint16_t raw[] = {49'999, 50'000, 50'001, 65'535, 1};
  std::copy(std::begin(raw), std::end(raw), ranges.ranges_mm.begin());
  DriverConfig config = vendor_config();
  EXPECT_EQ(points_of({samples::auxiliary(1), ranges}, config).size(), 2U);
  config.range_min_m = 0.2;
  const auto points = points_of({samples::auxiliary(1), ranges}, config);
  ASSERT_EQ(points.size(), 1U);
  EXPECT_EQ(points[0].index, 0);
  EXPECT_EQ(returns_of(ranges), 5);
}

TEST(ScanGeometry, AppliesScaleAndBiasOfTheRange) {
  DriverConfig config = vendor_config();
  config.range_bias_m = 0.5;
  config.range_scale = 0.0005;
  Auxiliary angles = samples::auxiliary(1);
  angles.b_axis_mm = 0.0F;
  for (const SensorPoint& point : points_of({angles, samples::distance(1)}, config)) {
    EXPECT_NEAR((point.position - Eigen::Vector3d(0.0, 0.0, config.z_bias_m)).norm(), 1.5, 1e-9);
  }
}

}  // namespace
}  // namespace ignis::l1
