// SPDX-License-Identifier: Apache-2.0
#include "frontend/deskew.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/so3.h"
#include "frontend/synthetic_world.h"
#include "frontend/voxel_downsample.h"

namespace ignis {
namespace {

test::Sensors ideal_sensors() {
  test::Sensors sensors;
  sensors.gyro_density = 0.0;
  sensors.accel_density = 0.0;
  sensors.gyro_bias.setZero();
  sensors.accel_bias.setZero();
  sensors.range_sigma = 0.0;
  sensors.range_grid = 1e-6;
  return sensors;
}

constexpr double kGravity = 9.81;
const test::World kCube{{{-3.0, -3.0, -3.0}, {3.0, 3.0, 3.0}}, {}, {}};

/// [m] largest distance of a point, placed in the world, from the nearest wall of the cube.
double wall_thickness(const std::vector<CloudPoint>& cloud, const Pose& T_world_body) {
  double worst = 0.0;
  for (const CloudPoint& point : cloud) {
    const Eigen::Vector3d p = T_world_body * Eigen::Vector3d(point.position.cast<double>());
    worst = std::max(worst, std::abs(p.cwiseAbs().maxCoeff() - 3.0));
  }
  return worst;
}

NavState state_at(const test::Trajectory& truth, double t, Utime utime) {
  NavState state;
  state.utime = utime;
  state.T_odom_body = truth(t);
  state.v_odom = (truth(t + 1e-4).translation - truth(t - 1e-4).translation) / 2e-4;
  return state;
}

std::vector<CloudPoint> raw_cloud(const Scan& scan) {
  std::vector<CloudPoint> cloud;
  for (const ScanPoint& point : scan.points) cloud.push_back({point.position, point.intensity});
  return cloud;
}

TEST(Deskew, PureRotationMakesWallsThin) {
  const test::Trajectory truth = [](double t) {
    return Pose{so3::exp({0.0, 2.0 * t, 0.3 * t}), Eigen::Vector3d::Zero()};
  };
  const test::Drive drive = test::simulate(kCube, truth, 0.3, ideal_sensors(), 1);
  const Scan& scan = drive.scans[2];
  const auto cloud = deskew(scan, state_at(truth, 0.15, scan.end_utime()), drive.imu, kGravity);
  EXPECT_GT(wall_thickness(raw_cloud(scan), truth(0.15)), 0.1);
  EXPECT_LT(wall_thickness(cloud, truth(0.15)), 1e-3);
}

TEST(Deskew, TranslationWithAccelerationMakesWallsThin) {
  const test::Trajectory truth = [](double t) {
    return Pose{so3::exp({0.0, 0.5 * t, 0.0}), {0.4 * std::sin(3.0 * t), 0.0, -2.0 * t}};
  };
  const test::Drive drive = test::simulate(kCube, truth, 0.3, ideal_sensors(), 1);
  const Scan& scan = drive.scans[2];
  NavState end = state_at(truth, 0.15, scan.end_utime());
  EXPECT_LT(wall_thickness(deskew(scan, end, drive.imu, kGravity), truth(0.15)), 1e-3);
  end.v_odom.setZero();
  EXPECT_GT(wall_thickness(deskew(scan, end, drive.imu, kGravity), truth(0.15)), 0.02)
      << "without a velocity the result is defined, but only as good as the rotation";
}

TEST(Deskew, LeavesPointsOfTheEndInPlace) {
  Scan scan;
  scan.duration_us = 50'000;
  scan.points = {{{1.0F, 2.0F, 3.0F}, 7.0F, 50'000}};
  NavState end;
  end.v_odom = {5.0, 0.0, 0.0};
  std::vector<ImuSample> samples(2);
  samples[1].utime = 60'000;
  const auto cloud = deskew(scan, end, samples, kGravity);
  ASSERT_EQ(cloud.size(), 1U);
  EXPECT_LT((cloud[0].position - scan.points[0].position).norm(), 1e-6F);
  EXPECT_EQ(cloud[0].intensity, 7.0F);
}

TEST(Deskew, ClampsInstantsOutsideTheScan) {
  Scan scan;
  scan.duration_us = 50'000;
  scan.points = {{{2.0F, 0.0F, 0.0F}, 0.0F, -1'000'000}, {{3.0F, 0.0F, 0.0F}, 0.0F, 1'000'000'000}};
  std::vector<ImuSample> samples(2);
  samples[1].utime = 50'000;
  NavState end;
  end.v_odom = {1.0, 0.0, 0.0};
  for (ImuSample& sample : samples) sample.accel = {0.0, kGravity, 0.0};
  const auto cloud = deskew(scan, end, samples, kGravity);
  ASSERT_EQ(cloud.size(), 2U);
  EXPECT_NEAR(cloud[0].position.x(), 2.0F - 0.05F, 1e-5F);
  EXPECT_NEAR(cloud[1].position.x(), 3.0F, 1e-5F);
}

TEST(VoxelDownsample, KeepsOnePointPerVoxelNearestItsCentre) {
  const std::vector<CloudPoint> cloud = {
      {{0.01F, 0.01F, 0.01F}, 1.0F}, {{0.12F, 0.1F, 0.1F}, 2.0F}, {{-0.01F, 0.1F, 0.1F}, 3.0F}};
  const auto kept = voxel_downsample(cloud, 0.2);
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[0].intensity, 2.0F);
  EXPECT_EQ(kept[1].intensity, 3.0F);
}

TEST(EveryNth, ThinsLargeCloudsToTheBoundAndLeavesSmallOnesAlone) {
  std::vector<CloudPoint> cloud;
  for (int i = 0; i < 5000; ++i) cloud.push_back({{static_cast<float>(i), 0.0F, 0.0F}, 0.0F});
  EXPECT_EQ(every_nth(cloud, 1000).size(), 1000U);
  EXPECT_EQ(every_nth(cloud, 5000).size(), 5000U);
  const auto thinned = every_nth(cloud, 1000);
  EXPECT_GT(thinned.back().position.x(), 4900.0F) << "evenly spread over the whole scan";
}

}  // namespace
}  // namespace ignis
