// SPDX-License-Identifier: Apache-2.0
//
// The published covariance against ground truth. The frame of the covariance is level and has its origin and heading at
// the first pose, so the tilt of the start is an error that it has to cover.
#include <gtest/gtest.h>

#include <random>

#include "common/so3.h"
#include "frontend/lio.h"
#include "frontend/lio_runner.h"

namespace ignis {
namespace {

using test::Drive;
using test::Sensors;

struct Nees {
  double position = 0.0;  ///< per degree of freedom, mean over the scans
  double attitude = 0.0;
  double nis = 0.0;  ///< of the innovations, per direction that a scan observes
};

Nees nees_of(std::uint32_t seed) {
  Sensors sensors;
  sensors.range_sigma = 0.02;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (double& bias : sensors.accel_bias) bias = test::tuned_config().accel_bias_sigma * normal(random);
  const Drive drive =
      test::simulate(test::furnished_hall(), test::ellipse_drive(2.0, 6.0, 4.0, 1.0), 20.0, sensors, seed);
  const test::LioRun run = test::run_lio(test::tuned_config(), drive);
  Nees nees;
  int count = 0;
  for (const ScanResult& scan : run.scans) {
    if (!scan.stats.applied()) continue;
    const Pose truth = drive.truth(test::drive_seconds(drive, scan.state.utime));
    const Eigen::Vector3d shift = truth.translation - scan.state.T_odom_body.translation;
    const Eigen::Vector3d turn = so3::log(scan.state.T_odom_body.rotation.conjugate() * truth.rotation);
    nees.position += shift.dot(scan.covariance.block<3, 3>(kPosition, kPosition).inverse() * shift) / 3.0;
    nees.nis += scan.stats.nis_directions > 0 ? scan.stats.nis / scan.stats.nis_directions : 0.0;
    nees.attitude += turn.dot(scan.covariance.block<3, 3>(kAttitude, kAttitude).inverse() * turn) / 3.0;
    ++count;
  }
  nees.position /= count;
  nees.attitude /= count;
  nees.nis /= count;
  return nees;
}

TEST(LioHonesty, ErrorsOfFiveDrivesAreWhatTheCovarianceSays) {
  Nees mean;
  constexpr int kSeeds = 5;
  for (std::uint32_t seed = 1; seed <= kSeeds; ++seed) {
    const Nees nees = nees_of(seed);
    mean.position += nees.position / kSeeds;
    mean.attitude += nees.attitude / kSeeds;
    mean.nis += nees.nis / kSeeds;
  }
  RecordProperty("position_nees_per_dof", std::to_string(mean.position));
  RecordProperty("attitude_nees_per_dof", std::to_string(mean.attitude));
  RecordProperty("nis_per_direction", std::to_string(mean.nis));
  // 95 % of chi-square with 5 x 3 degrees of freedom, one draw a drive: scans of one drive share their errors.
  EXPECT_GT(mean.position, 6.26 / 15.0);
  EXPECT_LT(mean.position, 27.49 / 15.0);
  // Heading is zero by definition at the start, so two of the three degrees of freedom are drawn: 5 x 2, per 5 x 3.
  EXPECT_GT(mean.attitude, 3.25 / 15.0);
  EXPECT_LT(mean.attitude, 20.48 / 15.0);
  // Residuals of scans that follow each other are not independent, so their variance is told `residual_inflation` times
  // as large on purpose. An innovation is part residual, part prediction: its square is expected between one over the
  // inflation and one. Above, the filter believes too much; below, too little even for that.
  EXPECT_GT(mean.nis, 1.0 / test::tuned_config().residual_inflation);
  EXPECT_LT(mean.nis, 1.0);
}

}  // namespace
}  // namespace ignis
