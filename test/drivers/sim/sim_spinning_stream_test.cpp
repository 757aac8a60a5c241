// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/spinning_stream.h"

#include <numbers>

#include <gtest/gtest.h>

#include "common/config_check.h"
#include "drivers/sim/shipped_scenes.h"
#include "drivers/sim/sim_rooms.h"

namespace ignis::sim {
namespace {

constexpr double kFloatDigits = 2e-5;  // [m] of a float at tens of metres
constexpr Utime kTurnUs = 100'000;
constexpr std::size_t kBeams = 16;
constexpr std::size_t kColumns = 360;

SceneConfig spinning_room() {
  SceneConfig scene = room();
  scene.lidar.model = "spinning";
  scene.lidar.spinning = {.beams = kBeams,
                          .lowest_deg = -30.0,
                          .highest_deg = 30.0,
                          .columns = kColumns,
                          .range_noise_m = 0.0,
                          .min_range_m = 0.0};
  return scene;
}

/// A mount with a lever arm and all three angles, so that a forgotten part of it shows.
Extrinsics on_a_mast() {
  Extrinsics extrinsics;
  extrinsics.lidar = {.yaw_deg = 20.0, .pitch_deg = -10.0, .roll_deg = 5.0, .translation_m = {0.2, 0.9, -0.4}};
  extrinsics.imu = {.axes = "right_up_back", .yaw_deg = 90.0};
  return extrinsics;
}

struct Measurements {
  std::vector<ImuSample> samples;
  std::vector<Scan> scans;
};

Measurements all_of(SpinningStream& stream) {
  Measurements all;
  while (const auto event = stream.next()) {
    if (const auto* scan = std::get_if<Scan>(&*event)) {
      all.scans.push_back(*scan);
    } else {
      all.samples.push_back(std::get<ImuSample>(*event));
    }
  }
  return all;
}

Measurements measured(const SceneConfig& scene, std::uint64_t seed, double seconds) {
  SpinningStream stream(scene, on_a_mast(), seed, seconds);
  return all_of(stream);
}

/// A pose of the scan's start instead of the point's own instant would be off by decimetres while turning.
TEST(SpinningStream, PointsLieOnTheSurfacesSeenFromThePoseOfTheirOwnInstant) {
  const SceneConfig scene = spinning_room();
  const RayScene geometry = make_ray_scene(scene);
  SpinningStream stream(scene, on_a_mast(), 1);
  std::size_t points = 0;
  for (const Scan& scan : all_of(stream).scans) {
    for (std::size_t i = 0; i < scan.points.size(); i += 5) {
      const ScanPoint& point = scan.points[i];
      const Pose T_world_body = stream.truth_at(scan.utime + point.dt_us).T_world_body;
      // Stamps are rounded to 1 us, in which the room's corner moves by micrometres.
      ASSERT_LT(std::abs(geometry.clearance(T_world_body * point.position.cast<double>().eval())), kFloatDigits);
      ++points;
    }
  }
  EXPECT_GT(points, 100000U);
}

TEST(SpinningStream, TurnsEvenlyFromItsFirstColumnToTheRight) {
  SceneConfig scene = spinning_room();
  scene.lidar.spinning.start_deg = 90.0;
  const Pose T_lidar_body = on_a_mast().lidar.T_body_sensor().inverse();
  const Measurements all = measured(scene, 1, 0.5);
  ASSERT_EQ(all.scans.size(), 5U);
  for (const Scan& scan : all.scans) {
    ASSERT_EQ(scan.points.size(), kBeams * kColumns);
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const auto column = static_cast<double>(i / kBeams);
      const Eigen::Vector3d p_lidar = T_lidar_body * scan.points[i].position.cast<double>().eval();
      const double azimuth_deg = std::atan2(p_lidar.y(), p_lidar.x()) * 180.0 / std::numbers::pi;
      ASSERT_NEAR(std::remainder(azimuth_deg - (90.0 - column * 360.0 / kColumns), 360.0), 0.0, 1e-3);
      const double elevation_deg = std::asin(p_lidar.normalized().z()) * 180.0 / std::numbers::pi;
      ASSERT_NEAR(elevation_deg, -30.0 + 4.0 * static_cast<double>(i % kBeams), 1e-3);
      ASSERT_NEAR(scan.points[i].dt_us, column * kTurnUs / kColumns, 1.0);
    }
  }
}

TEST(SpinningStream, StampsScansFromTheirFirstPointToTheirLast) {
  const Measurements all = measured(spinning_room(), 1, 1.0);
  ASSERT_EQ(all.scans.size(), 10U);
  for (std::size_t i = 0; i < all.scans.size(); ++i) {
    const Scan& scan = all.scans[i];
    EXPECT_EQ(scan.sequence, static_cast<std::int32_t>(i));
    EXPECT_EQ(scan.utime, static_cast<Utime>(i) * kTurnUs);
    EXPECT_EQ(scan.points.front().dt_us, 0);
    EXPECT_EQ(scan.points.back().dt_us, scan.duration_us);
    EXPECT_TRUE(std::ranges::is_sorted(scan.points, {}, &ScanPoint::dt_us));
  }
}

/// With nothing to see but a wall ahead, the first return comes a quarter turn after the first column.
TEST(SpinningStream, StampsAScanWithItsFirstReturnWhereColumnsSeeNothing) {
  SceneConfig scene = spinning_room();
  scene.planes.clear();
  scene.boxes = {{.center_m = {0, 0, -20}, .size_m = {1.0, 40, 1}}};
  SpinningStream stream(scene, Extrinsics{}, 1, 0.2);
  const std::vector<Scan> scans = all_of(stream).scans;
  ASSERT_EQ(scans.size(), 2U);
  ASSERT_FALSE(scans[1].points.empty());
  EXPECT_NEAR(static_cast<double>(scans[1].utime), 1.5 * kTurnUs, 0.01 * kTurnUs);
  EXPECT_EQ(scans[1].points.front().dt_us, 0);
  EXPECT_EQ(scans[1].points.back().dt_us, scans[1].duration_us);
}

TEST(SpinningStream, GivesMeasurementsInTheOrderOfTheirCompletion) {
  SpinningStream stream(spinning_room(), on_a_mast(), 1, 1.0);
  Utime newest_sample = -1;
  int scans = 0;
  while (const auto event = stream.next()) {
    if (const auto* sample = std::get_if<ImuSample>(&*event)) {
      EXPECT_EQ(sample->utime, newest_sample < 0 ? 0 : newest_sample + 5000);
      newest_sample = sample->utime;
    } else {
      // The sample at the end of the turn is there, the one after it is not.
      EXPECT_EQ(newest_sample, ++scans * kTurnUs);
    }
  }
  EXPECT_EQ(newest_sample, 1'000'000);
  EXPECT_EQ(scans, 10);
}

TEST(SpinningStream, GivesTheSameMeasurementsForTheSameSeedOnly) {
  SceneConfig scene = spinning_room();
  scene.lidar.spinning.range_noise_m = 0.02;
  const auto ranges = [&](std::uint64_t seed) {
    std::vector<float> values;
    const Measurements all = measured(scene, seed, 0.3);
    for (const Scan& scan : all.scans) {
      for (const ScanPoint& point : scan.points) values.push_back(point.position.norm());
    }
    for (const ImuSample& sample : all.samples) values.push_back(static_cast<float>(sample.gyro.x()));
    return values;
  };
  EXPECT_EQ(ranges(7), ranges(7));
  EXPECT_NE(ranges(7), ranges(8));
}

TEST(SpinningStream, HasTheRangeNoiseAndTheLossesOfItsConfiguration) {
  SceneConfig scene = spinning_room();
  scene.trajectory.waypoints[0].rest_s = 10.0;
  scene.lidar.spinning.range_noise_m = 0.03;
  scene.lidar.spinning.invalid_fraction = 0.1;
  const RayScene geometry = make_ray_scene(scene);
  SpinningStream stream(scene, on_a_mast(), 1, 1.0);
  const Pose T_body_lidar = on_a_mast().lidar.T_body_sensor();
  const Pose T_world_lidar = stream.truth_at(0).T_world_body * T_body_lidar;
  const Measurements all = all_of(stream);
  double sum = 0.0;
  double square = 0.0;
  double count = 0.0;
  for (const Scan& scan : all.scans) {
    for (const ScanPoint& point : scan.points) {
      const Eigen::Vector3d p_lidar = T_body_lidar.inverse() * point.position.cast<double>().eval();
      const auto hit = geometry.cast({T_world_lidar.translation, T_world_lidar.rotation * p_lidar.normalized()}, 100.0);
      ASSERT_TRUE(hit);
      const double error = p_lidar.norm() - hit->distance;
      sum += error;
      square += error * error;
      ++count;
    }
  }
  EXPECT_NEAR(std::sqrt(square / count), 0.03, 0.0005);
  EXPECT_NEAR(sum / count, 0.0, 0.0005);
  const auto shots = static_cast<double>(all.scans.size() * kBeams * kColumns);
  EXPECT_NEAR(1.0 - count / shots, 0.1, 0.005);
}

TEST(SpinningStream, SeesNothingNearerFartherOrDarkerThanItsRange) {
  SceneConfig scene = spinning_room();
  for (PlaneConfig& plane : scene.planes) plane.reflectivity = 0.02;
  scene.lidar.spinning.min_range_m = 3.0;
  scene.lidar.spinning.max_range_m = 6.0;
  const Pose T_lidar_body = on_a_mast().lidar.T_body_sensor().inverse();
  SpinningStream stream(scene, on_a_mast(), 1, 0.5);
  std::size_t points = 0;
  for (const Scan& scan : all_of(stream).scans) {
    for (const ScanPoint& point : scan.points) {
      const double range = (T_lidar_body * point.position.cast<double>().eval()).norm();
      EXPECT_TRUE(range > 3.0 - kFloatDigits && range < 6.0 + kFloatDigits) << range;
      ++points;
    }
  }
  EXPECT_GT(points, 1000U);
  scene.lidar.spinning.max_range_m = 100.0;
  scene.lidar.spinning.range_at_10_percent_m = 1.0;
  scene.lidar.spinning.range_at_90_percent_m = 2.9;
  SpinningStream blind(scene, on_a_mast(), 1, 0.2);
  for (const Scan& scan : all_of(blind).scans) EXPECT_TRUE(scan.points.empty());
}

TEST(SpinningStream, PublishesTheImuInBodyAxesWithTheNoiseOfItsConfiguration) {
  SceneConfig scene = spinning_room();
  scene.imu.gyro_bias = scene.imu.accel_bias = scene.imu.gyro_bias_walk = scene.imu.accel_bias_walk = 0.0;
  SpinningStream stream(scene, on_a_mast(), 1);
  double gyro_square = 0.0;
  double accel_square = 0.0;
  const Measurements all = all_of(stream);
  for (const ImuSample& sample : all.samples) {
    const ImuReading ideal = ideal_imu(stream.truth_at(sample.utime), Pose{});
    gyro_square += (sample.gyro - ideal.gyro).squaredNorm() / 3.0;
    accel_square += (sample.accel - ideal.accel).squaredNorm() / 3.0;
    EXPECT_FALSE(sample.saturated);
  }
  const auto count = static_cast<double>(all.samples.size());
  const double root_rate = std::sqrt(scene.lidar.spinning.imu_rate_hz);
  EXPECT_NEAR(std::sqrt(gyro_square / count) / (scene.imu.gyro_noise * root_rate), 1.0, 0.05);
  EXPECT_NEAR(std::sqrt(accel_square / count) / (scene.imu.accel_noise * root_rate), 1.0, 0.05);
}

TEST(SpinningStream, MarksSamplesAtTheFullScaleOfTheUnit) {
  SceneConfig scene = spinning_room();
  scene.imu.accel_limit = 5.0;
  for (const ImuSample& sample : measured(scene, 1, 0.2).samples) EXPECT_TRUE(sample.saturated);
}

TEST(SpinningStream, AndTheL1RefuseEachOthersScenes) {
  EXPECT_THROW(SpinningStream(room(), on_a_mast(), 1), config::ConfigError);
  EXPECT_THROW(L1Stream(spinning_room(), on_a_mast(), 1), config::ConfigError);
}

class SpinningScenes : public ::testing::TestWithParam<std::string> {};

TEST_P(SpinningScenes, PutEveryReturnOnASurface) {
  SceneConfig scene = load_scene(test::scene_folder() / GetParam());
  scene.lidar.spinning.range_noise_m = 0.0;
  const RayScene geometry = make_ray_scene(scene);
  SpinningStream stream(scene, on_a_mast(), 1, 6.0);
  std::size_t points = 0;
  for (const Scan& scan : all_of(stream).scans) {
    for (std::size_t i = 0; i < scan.points.size(); i += 101) {
      const Utime utime = scan.utime + scan.points[i].dt_us;
      const Eigen::Vector3d p_world =
          stream.truth_at(utime).T_world_body * scan.points[i].position.cast<double>().eval();
      ASSERT_LT(std::abs(geometry.clearance(p_world, static_cast<double>(utime) * 1e-6)), kFloatDigits);
      ++points;
    }
  }
  EXPECT_GT(points, 20000U);
}

INSTANTIATE_TEST_SUITE_P(All, SpinningScenes, ::testing::ValuesIn(test::shipped_scenes("spinning")), test::kSceneName);

}  // namespace
}  // namespace ignis::sim
