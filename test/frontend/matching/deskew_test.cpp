// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/deskew.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/so3.h"
#include "frontend/local_map/voxel_downsample.h"
#include "frontend/synthetic_world.h"

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

/// A drive whose points are measured four at a time, as the columns of a spinning LiDAR, and the same points one by
/// one.
TEST(Deskew, MovesPointsOfOneInstantAsItMovesEachAlone) {
  const test::Trajectory truth = [](double t) {
    return Pose{so3::exp({0.1 * t, 3.0 * t, 0.0}), {0.4 * std::sin(3.0 * t), 0.1 * t, -2.0 * t}};
  };
  const test::Drive drive = test::simulate(kCube, truth, 0.3, ideal_sensors(), 1);
  Scan columns = drive.scans[2];
  for (std::size_t i = 0; i < columns.points.size(); ++i) columns.points[i].dt_us = columns.points[i / 4 * 4].dt_us;
  const NavState end = state_at(truth, 0.15, columns.end_utime());
  const auto together = deskew(columns, end, drive.imu, kGravity);
  ASSERT_EQ(together.size(), columns.points.size());
  for (std::size_t i = 0; i < columns.points.size(); ++i) {
    Scan alone = columns;
    alone.points = {columns.points[i]};
    const auto point = deskew(alone, end, drive.imu, kGravity);
    ASSERT_LT((together[i].position - point.front().position).norm(), 1e-6F) << "point " << i;
  }
}

TEST(VoxelDownsample, KeepsOnePointPerVoxelNearestItsCentre) {
  const std::vector<CloudPoint> cloud = {
      {{0.01F, 0.01F, 0.01F}, 1.0F}, {{0.12F, 0.1F, 0.1F}, 2.0F}, {{-0.01F, 0.1F, 0.1F}, 3.0F}};
  const auto kept = voxel_downsample(cloud, 0.2);
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[0].intensity, 2.0F);
  EXPECT_EQ(kept[1].intensity, 3.0F);
}

/// The point nearest the centre of each voxel, by exhaustive search.
std::vector<std::int32_t> picked_by_search(const std::vector<CloudPoint>& cloud, float edge) {
  std::vector<Eigen::Vector3f> centres;
  std::vector<std::int32_t> picked;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f centre = edge * ((cloud[i].position * (1.0F / edge)).array().floor() + 0.5F);
    const auto known = static_cast<std::size_t>(std::ranges::find(centres, centre) - centres.begin());
    if (known == centres.size()) {
      centres.push_back(centre);
      picked.push_back(static_cast<std::int32_t>(i));
    } else if ((cloud[i].position - centre).squaredNorm() <
               (cloud[static_cast<std::size_t>(picked[known])].position - centre).squaredNorm()) {
      picked[known] = static_cast<std::int32_t>(i);
    }
  }
  return picked;
}

TEST(VoxelThinner, PicksWhatASearchFindsFromCloudToCloud) {
  std::mt19937 random(7);
  VoxelThinner thinner;
  for (const int points : {3000, 0, 9000, 50, 3000}) {  // grows, and goes on with what it has
    // A floor, a wall along z and some points between: rows of voxels along every axis.
    std::uniform_real_distribution<float> place(-6.0F, 6.0F);
    std::vector<CloudPoint> cloud;
    for (int i = 0; i < points; ++i) {
      Eigen::Vector3f at(place(random), place(random), place(random));
      if (i % 3 != 2) at[i % 3] = -1.03F;
      cloud.push_back({at, 0.0F});
    }
    std::vector<std::int32_t> picked;
    for (const auto& each : thinner.pick(std::span<const CloudPoint>(cloud), 0.25)) picked.push_back(each.point);
    ASSERT_EQ(picked, picked_by_search(cloud, 0.25F)) << points;
  }
}

TEST(VoxelThinner, LeavesOutWhatIsNotAccepted) {
  const std::vector<CloudPoint> cloud = {{{0.1F, 0.1F, 0.1F}, 1.0F}, {{0.12F, 0.1F, 0.1F}, 2.0F}};
  VoxelThinner thinner;
  const auto picked = thinner.pick(std::span<const CloudPoint>(cloud), 0.2,
                                   [](const CloudPoint& point) { return point.intensity > 1.5F; });
  ASSERT_EQ(picked.size(), 1U);
  EXPECT_EQ(picked[0].point, 1);
}

TEST(EveryNth, ThinsLargeCloudsToTheBoundAndLeavesSmallOnesAlone) {
  std::vector<CloudPoint> cloud;
  for (int i = 0; i < 5000; ++i) cloud.push_back({{static_cast<float>(i), 0.0F, 0.0F}, 0.0F});
  std::vector<Eigen::Vector3f> positions = {Eigen::Vector3f::Ones()};
  every_nth(cloud, 5001, positions);
  EXPECT_EQ(positions.size(), 5000U);
  every_nth(cloud, 1000, positions);
  EXPECT_EQ(positions.size(), 1000U);
  EXPECT_GT(positions.back().x(), 4900.0F) << "evenly spread over the whole scan";
}

}  // namespace
}  // namespace ignis
