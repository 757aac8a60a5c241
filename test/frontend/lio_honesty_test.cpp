// SPDX-License-Identifier: Apache-2.0
//
// The published covariance against ground truth. The frame of the covariance is level and has its origin and heading at
// the first pose, so the tilt of the start is an error that it has to cover.
#include <gtest/gtest.h>

#include <random>

#include "frontend/lio.h"
#include "frontend/lio_runner.h"

namespace ignis {
namespace {

using test::Drive;
using test::Sensors;

struct Honesty {
  test::PoseNees nees;
  double nis = 0.0;  ///< of the innovations, per direction that a scan observes; mean over the scans
};

double mean_nis(const test::LioRun& run) {
  double sum = 0.0;
  int scans = 0;
  for (const ScanResult& scan : run.scans) {
    if (!scan.stats.applied()) continue;
    sum += scan.stats.nis_directions > 0 ? scan.stats.nis / scan.stats.nis_directions : 0.0;
    ++scans;
  }
  return sum / scans;
}

Honesty honesty_of(std::uint32_t seed) {
  Sensors sensors;
  sensors.range_sigma = 0.02;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (double& bias : sensors.accel_bias) bias = test::tuned_config().accel_bias_sigma * normal(random);
  const Drive drive =
      test::simulate(test::furnished_hall(), test::ellipse_drive(2.0, 6.0, 4.0, 1.0), 20.0, sensors, seed);
  const test::LioRun run = test::run_lio(test::tuned_config(), drive);
  return {.nees = test::pose_nees(run, drive), .nis = mean_nis(run)};
}

TEST(LioHonesty, ErrorsOfFiveDrivesAreWhatTheCovarianceSays) {
  Honesty mean;
  constexpr int kSeeds = 5;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    const Honesty drive = honesty_of(seed);
    mean.nees.position += drive.nees.position / kSeeds;
    mean.nees.attitude += drive.nees.attitude / kSeeds;
    mean.nis += drive.nis / kSeeds;
  }
  RecordProperty("position_nees_per_dof", std::to_string(mean.nees.position));
  RecordProperty("attitude_nees_per_dof", std::to_string(mean.nees.attitude));
  RecordProperty("nis_per_direction", std::to_string(mean.nis));
  // 95 % of chi-square with 5 x 3 degrees of freedom, one draw a drive: scans of one drive share their errors.
  EXPECT_GT(mean.nees.position, 6.26 / 15.0);
  EXPECT_LT(mean.nees.position, 27.49 / 15.0);
  // Heading is zero by definition at the start, so two of the three degrees of freedom are drawn: 5 x 2, per 5 x 3.
  EXPECT_GT(mean.nees.attitude, 3.25 / 15.0);
  EXPECT_LT(mean.nees.attitude, 20.48 / 15.0);
  // Residuals of scans that follow each other are not independent, so their variance is told `residual_inflation` times
  // as large on purpose. An innovation is part residual, part prediction: its square is expected between one over the
  // inflation and one. Above, the filter believes too much; below, too little even for that.
  EXPECT_GT(mean.nis, 1.0 / test::tuned_config().residual_inflation);
  EXPECT_LT(mean.nis, 1.0);
}

/// Published variance of the position on the ground at the end [m^2], when for three seconds of the drive what lies to
/// the left and to the right is seen closer by than it is, by this share.
double variance_after_squeezed_scans(double share) {
  Drive drive = test::simulate(test::furnished_hall(), test::ellipse_drive(2.0, 6.0, 4.0, 1.0), 18.0, Sensors{}, 1);
  for (Scan& scan : drive.scans) {
    const double now = test::drive_seconds(drive, scan.end_utime());
    if (now < 10.0 || now > 13.0) continue;
    for (ScanPoint& point : scan.points) point.position.x() *= static_cast<float>(1.0 - share);
  }
  const test::LioRun run = test::run_lio(test::tuned_config(), drive);
  EXPECT_EQ(run.scans.back().stats.session, 0);
  const auto variance = run.scans.back().covariance.diagonal();
  return variance[kPosition] + variance[kPosition + 2];
}

TEST(LioHonesty, WhatWasMappedWhileItsPlanesContradictedEachOtherStaysInTheCovariance) {
  EXPECT_GT(variance_after_squeezed_scans(0.03), 2.0 * variance_after_squeezed_scans(0.0));
}

}  // namespace
}  // namespace ignis
