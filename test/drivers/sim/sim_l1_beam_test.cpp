// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/l1_beam.h"

#include <gtest/gtest.h>

#include "common/config_check.h"

namespace ignis::sim {
namespace {

/// The packet of the protocol sheet whose decoded points the vendor's library gave (section 7).
l1::Auxiliary sheet_packet() {
  l1::Auxiliary packet;
  packet.yaw_start_deg = 124.5F;
  packet.yaw_step_deg = 10.1F;
  packet.vertical_start_deg = 0.1875F;
  packet.vertical_step_deg = 1.5F;
  packet.b_axis_mm = 6.6F;
  packet.ksi_rad = 0.03F;
  return packet;
}

TEST(Beam, LeadsToThePointsThatTheVendorDecodes) {
  const auto point = [](std::size_t j) {
    const Ray ray = beam(sheet_packet(), j);
    return Eigen::Vector3d(ray.origin + 2.0 * ray.direction);
  };
  // The vendor computes in float32; the sheet found up to 7 um.
  constexpr double kVendorDigits = 1.5e-5;
  EXPECT_LT((point(0) - Eigen::Vector3d(-1.997944, 0.086189, 0.051042)).norm(), kVendorDigits);
  EXPECT_LT((point(59) - Eigen::Vector3d(-0.044886, -0.054155, 2.043076)).norm(), kVendorDigits);
  EXPECT_LT((point(119) - Eigen::Vector3d(1.993165, 0.156368, 0.090286)).norm(), kVendorDigits);
}

TEST(Beam, HasUnitDirectionForAnyCalibration) {
  l1::Auxiliary packet = sheet_packet();
  packet.theta_rad = -0.03F;
  for (std::size_t j = 0; j < l1::kPointsPerPacket; ++j) EXPECT_NEAR(beam(packet, j).direction.norm(), 1.0, 1e-12);
}

TEST(RangeOnGrid, StaysWithinHalfAStepAndOnTheGrid) {
  const L1BeamConfig config;
  for (double range = 0.06; range < 49.9; range += 0.0137) {
    const double mm = range_on_grid(config, range);
    EXPECT_LE(std::abs(mm - range * 1e3), 0.5 * config.range_grid_mm + 0.5);
    const double steps = mm / config.range_grid_mm;
    EXPECT_LE(std::abs(steps - std::round(steps)) * config.range_grid_mm, 0.5 + 1e-9);
  }
}

TEST(RangeOnGrid, ReportsNothingBelowTheBlindZoneAndBeyondTheSensor) {
  const L1BeamConfig config;
  EXPECT_EQ(range_on_grid(config, 0.049), 0);
  EXPECT_EQ(range_on_grid(config, -1.0), 0);
  EXPECT_EQ(range_on_grid(config, 50.0), 0);
  EXPECT_GT(range_on_grid(config, 0.051), 0);
}

TEST(L1BeamConfig, RefusesAFartherRangeForDarkThanForBright) {
  L1BeamConfig config;
  config.range_at_90_percent_m = 5.0;
  EXPECT_THROW(config::require_valid(config), config::ConfigError);
}

}  // namespace
}  // namespace ignis::sim
