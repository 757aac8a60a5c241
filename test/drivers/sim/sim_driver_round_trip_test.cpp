// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "drivers/l1_decoder.h"
#include "drivers/scan_geometry.h"
#include "drivers/sim/l1_stream.h"
#include "drivers/sim/shipped_scenes.h"

namespace ignis::sim {
namespace {

SceneConfig perfect_hall() {
  SceneConfig scene = load_scene(std::string(IGNIS_CONFIG_DIR) + "/scenes/battery_hall_quick.json");
  scene.lidar.l1.range_noise_m = 0.0;
  scene.imu = {
      .gyro_noise = 0, .accel_noise = 0, .gyro_bias = 0, .accel_bias = 0, .gyro_bias_walk = 0, .accel_bias_walk = 0};
  return scene;
}

/// The driver knows nothing of the simulator but its bytes: what it publishes must be the world that was simulated.
TEST(SimulatedBytes, DecodeToTheWorldAndTheMotionThatWereSimulated) {
  const SceneConfig scene = perfect_hall();
  const RayScene geometry = make_ray_scene(scene);
  L1Stream stream(scene, l1_extrinsics(), 1, 20.0);
  DriverConfig config;
  config.time_source = "counters";
  l1::L1Decoder decoder(config, l1_extrinsics());

  // Half a step of the range grid, and 1 ms of clock error at 1.5 m/s and 0.9 rad/s over a few metres.
  constexpr double kPointTolerance = 0.015;
  // 1 ms of clock error while turning in; the acceleration's reference moves as little.
  constexpr double kRateTolerance = 0.01;
  constexpr double kForceTolerance = 0.05;
  std::size_t points = 0;
  std::size_t points_off = 0;
  std::size_t samples = 0;
  double worst_rate = 0.0;
  double worst_force = 0.0;
  const auto check = [&](const std::vector<l1::Event>& events) {
    for (const l1::Event& event : events) {
      if (const auto* scan = std::get_if<Scan>(&event)) {
        for (const ScanPoint& point : scan->points) {
          const Pose T_world_body = stream.truth_at(scan->utime + point.dt_us).T_world_body;
          const double distance = std::abs(geometry.clearance(T_world_body * point.position.cast<double>().eval()));
          points_off += distance > kPointTolerance ? 1 : 0;
          ++points;
        }
      } else if (const auto* imu = std::get_if<ImuSample>(&event)) {
        const Motion motion = stream.truth_at(imu->utime);
        const ImuReading ideal = ideal_imu(motion, Pose{});
        worst_rate = std::max(worst_rate, (imu->gyro - ideal.gyro).norm());
        worst_force = std::max(worst_force, (imu->accel - ideal.accel).norm());
        ++samples;
      }
    }
  };
  while (const auto frame = stream.next_frame()) check(decoder.feed(frame->bytes, frame->send_utime));
  check(decoder.finish());

  EXPECT_EQ(samples, 5001U);
  EXPECT_GT(points, 200000U);
  EXPECT_EQ(points_off, 0U);
  EXPECT_LT(worst_rate, kRateTolerance);
  EXPECT_LT(worst_force, kForceTolerance);
  EXPECT_EQ(decoder.counters().scan_gaps + decoder.counters().imu_gaps + decoder.counters().rejected_values, 0);
}

class RoundTrip : public ::testing::TestWithParam<std::string> {};

/// Encoded, decoded, and put where the vehicle truly was at each point's instant: every return must lie on a surface.
TEST_P(RoundTrip, PutsEveryReturnOnASurfaceWithinOneStepOfTheRangeGrid) {
  SceneConfig scene = load_scene(test::scene_folder() / GetParam());
  scene.lidar.l1.range_noise_m = 0.0;
  const RayScene geometry = make_ray_scene(scene);
  constexpr double kSeconds = 20.0;
  L1Stream stream(scene, l1_extrinsics(), 1, kSeconds);
  DriverConfig config;
  config.time_source = "counters";
  const Pose T_body_lidar = l1_extrinsics().lidar.T_body_sensor();
  const double step = scene.lidar.l1.range_grid_mm * 1e-3;

  l1::PacketStream packets(config);
  std::optional<std::int64_t> first;
  std::int64_t points = 0;
  double worst = 0.0;
  while (const auto frame = stream.next_frame()) {
    for (const l1::Packet& packet : packets.feed(frame->bytes, 0)) {
      const auto* pair = std::get_if<l1::CountedPacket>(&packet);
      if (pair == nullptr) continue;
      if (!first) first = pair->count;
      const double scan_us = static_cast<double>(pair->count - *first) * l1::kScanPeriodUs;
      for (const l1::SensorPoint& point : l1::points_of(pair->pair, config)) {
        const Utime utime = std::llround(scan_us + point.index * l1::kPointPeriodUs);
        const Pose T_world_lidar = stream.truth_at(utime).T_world_body * T_body_lidar;
        const double distance = geometry.clearance(T_world_lidar * point.position, static_cast<double>(utime) * 1e-6);
        worst = std::max(worst, std::abs(distance));
        ++points;
      }
    }
  }
  EXPECT_GT(points, 10000);
  EXPECT_LT(worst, step);
  EXPECT_EQ(packets.counters().scan_gaps + packets.counters().imu_gaps + packets.counters().rejected_values, 0);
}

INSTANTIATE_TEST_SUITE_P(AllScenes, RoundTrip, ::testing::ValuesIn(test::shipped_scenes("l1")), test::kSceneName);

}  // namespace
}  // namespace ignis::sim
