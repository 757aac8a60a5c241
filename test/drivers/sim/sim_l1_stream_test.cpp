// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/l1_stream.h"

#include <map>

#include <gtest/gtest.h>

#include "drivers/sim/sim_rooms.h"

namespace ignis::sim {
namespace {

TEST(L1Stream, KeepsTheSensorsRates) {
  std::map<std::uint32_t, int> counts;
  for (const StreamFrame& frame : frames_of(room(), 1, 3.0)) ++counts[frame.message_id];
  EXPECT_NEAR(counts[l1::kAuxiliaryId], 540, 1);
  EXPECT_EQ(counts[l1::kDistanceId], counts[l1::kAuxiliaryId]);
  EXPECT_EQ(counts[l1::kImuId], 751);
  EXPECT_EQ(counts[l1::kTimeSyncId], 3);
  EXPECT_EQ(counts[l1::kVersionId], 1);
}

TEST(L1Stream, NeverOverlapsFramesOnTheLineNorSendsBeforeTheMeasurementEnds) {
  Utime line_free = 0;
  for (const StreamFrame& frame : frames_of(room(), 1, 3.0)) {
    EXPECT_GE(frame.send_utime, line_free - 1);
    line_free = frame.send_utime + static_cast<Utime>(frame.bytes.size()) * 5;
    if (frame.message_id == l1::kAuxiliaryId) {
      EXPECT_GE(frame.send_utime - frame.measured_utime, 3077);
      EXPECT_LE(frame.send_utime - frame.measured_utime, 3400);
    }
    if (frame.message_id == l1::kImuId) {
      EXPECT_GE(frame.send_utime - frame.measured_utime, 300);
      EXPECT_LE(frame.send_utime - frame.measured_utime, 3000);
    }
  }
}

TEST(L1Stream, SendsEachDistanceRightBehindItsAuxiliary) {
  const std::vector<StreamFrame> frames = frames_of(room(), 1, 1.0);
  int expected_id = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].message_id != l1::kAuxiliaryId) continue;
    ASSERT_LT(i + 1, frames.size());
    ASSERT_EQ(frames[i + 1].message_id, l1::kDistanceId);
    const l1::Auxiliary auxiliary = l1::decode_auxiliary(payload_of(frames[i]));
    EXPECT_EQ(auxiliary.packet_id, expected_id);
    EXPECT_EQ(l1::decode_distance(payload_of(frames[i + 1])).packet_id, expected_id);
    EXPECT_FLOAT_EQ(auxiliary.vertical_start_deg, 0.1875F * static_cast<float>(1 + expected_id % 8));
    ++expected_id;
  }
  EXPECT_NEAR(expected_id, 180, 1);
}

TEST(L1Stream, NumbersItsFramesWithoutGap) {
  std::uint8_t expected = 0;
  for (const StreamFrame& frame : frames_of(room(), 1, 1.0)) {
    EXPECT_EQ(static_cast<std::uint8_t>(frame.bytes[4]), expected++);
  }
}

TEST(L1Stream, GivesTheSameBytesForTheSameSeedOnly) {
  EXPECT_EQ(bytes_of(frames_of(room(), 7, 1.0)), bytes_of(frames_of(room(), 7, 1.0)));
  EXPECT_NE(bytes_of(frames_of(room(), 7, 1.0)), bytes_of(frames_of(room(), 8, 1.0)));
}

TEST(L1Stream, ShorterDurationIsAPrefix) {
  const std::vector<std::byte> shorter = bytes_of(frames_of(room(), 3, 0.5));
  const std::vector<std::byte> longer = bytes_of(frames_of(room(), 3, 1.0));
  ASSERT_LT(shorter.size(), longer.size());
  // The last frames of the shorter one may come in another order: what it no longer starts leaves the line free.
  EXPECT_TRUE(std::equal(shorter.begin(), shorter.end() - 1000, longer.begin()));
}

TEST(L1Stream, EndsWithTheDrive) {
  L1Stream stream(room(), tilted_forward(), 1);
  const std::vector<StreamFrame> frames = all_frames(stream);
  EXPECT_NEAR(static_cast<double>(frames.back().measured_utime) * 1e-6, stream.trajectory().duration(), 0.01);
  EXPECT_FALSE(stream.next_frame());
}

/// Decodes every point by the vendor's formula with the true pose of the point's own instant: without noise it must lie
/// on a surface of the room to within half a step of the range grid. A pose of the scan's start instead would be off by
/// more while turning, so this also proves that each point has its own time.
TEST(L1Stream, PointsLieOnTheSurfacesSeenFromThePoseOfTheirOwnInstant) {
  SceneConfig scene = room();
  scene.lidar.l1.range_noise_m = 0.0;
  const RayScene geometry = make_ray_scene(scene);
  const Pose T_body_lidar = tilted_forward().lidar.T_body_sensor();
  L1Stream stream(scene, tilted_forward(), 1);
  l1::Auxiliary auxiliary;
  std::size_t points = 0;
  while (const auto frame = stream.next_frame()) {
    if (frame->message_id == l1::kAuxiliaryId) auxiliary = l1::decode_auxiliary(payload_of(*frame));
    if (frame->message_id != l1::kDistanceId) continue;
    const l1::Distance distance = l1::decode_distance(payload_of(*frame));
    for (std::size_t j = 0; j < l1::kPointsPerPacket; j += 7) {
      if (distance.ranges_mm[j] == 0) continue;
      const double t = distance.packet_id / 180.0 + static_cast<double>(j) / 43200.0;
      const Ray ray = beam(auxiliary, j);
      const Pose T_world_lidar = stream.trajectory().at(t).T_world_body * T_body_lidar;
      const Eigen::Vector3d p_world = T_world_lidar * (ray.origin + 1e-3 * distance.ranges_mm[j] * ray.direction);
      ASSERT_LT(std::abs(geometry.clearance(p_world)), 0.5e-3 * scene.lidar.l1.range_grid_mm + 0.6e-3);
      ++points;
    }
  }
  EXPECT_GT(points, 20000U);
}

TEST(L1Stream, HasTheRangeNoiseAndTheLossesOfItsConfiguration) {
  SceneConfig scene = room();
  scene.trajectory.waypoints[0].rest_s = 10.0;
  scene.lidar.l1.range_grid_mm = 1.0;
  scene.lidar.l1.range_noise_m = 0.02;
  scene.lidar.l1.invalid_fraction = 0.1;
  scene.lidar.l1.range_at_10_percent_m = 40.0;
  scene.lidar.l1.range_at_90_percent_m = 40.0;
  const RayScene geometry = make_ray_scene(scene);
  L1Stream stream(scene, tilted_forward(), 1, 2.0);
  const Pose T_world_lidar = stream.truth_at(0).T_world_body * tilted_forward().lidar.T_body_sensor();
  l1::Auxiliary auxiliary;
  double square = 0.0;
  int valid = 0;
  int all = 0;
  while (const auto frame = stream.next_frame()) {
    if (frame->message_id == l1::kAuxiliaryId) auxiliary = l1::decode_auxiliary(payload_of(*frame));
    if (frame->message_id != l1::kDistanceId) continue;
    const l1::Distance distance = l1::decode_distance(payload_of(*frame));
    for (std::size_t j = 0; j < l1::kPointsPerPacket; ++j) {
      const Ray ray = beam(auxiliary, j);
      const auto hit = geometry.cast({T_world_lidar * ray.origin, T_world_lidar.rotation * ray.direction}, 60.0);
      ASSERT_TRUE(hit);
      ++all;
      EXPECT_EQ(distance.ranges_mm[j] == 0, auxiliary.reflectivity[j] == 0);
      if (distance.ranges_mm[j] == 0) continue;
      const double error = 1e-3 * distance.ranges_mm[j] - hit->distance;
      square += error * error;
      ++valid;
    }
  }
  EXPECT_NEAR(std::sqrt(square / valid), 0.02, 0.001);
  EXPECT_NEAR(static_cast<double>(all - valid) / all, 0.1, 0.01);
}

TEST(L1Stream, ReportsTheImuInItsOwnAxesWithTheSensorsQuaternion) {
  SceneConfig scene = room();
  scene.imu = {
      .gyro_noise = 0, .accel_noise = 0, .gyro_bias = 0, .accel_bias = 0, .gyro_bias_walk = 0, .accel_bias_walk = 0};
  scene.trajectory.tilt_deg = 0.0;
  for (const StreamFrame& frame : frames_of(scene, 1, 0.5)) {
    if (frame.message_id != l1::kImuId) continue;
    const l1::ImuAttitude imu = l1::decode_imu(payload_of(frame));
    // Tilted 45 degrees forward, gravity lies half on Z and half on X, which then looks downward.
    EXPECT_NEAR(imu.accel[0], -kGravity * std::sqrt(0.5), 1e-5);
    EXPECT_NEAR(imu.accel[1], 0.0, 1e-5);
    EXPECT_NEAR(imu.accel[2], kGravity * std::sqrt(0.5), 1e-5);
    const Eigen::Quaterniond q(imu.quaternion[0], imu.quaternion[1], imu.quaternion[2], imu.quaternion[3]);
    EXPECT_NEAR(q.norm(), 0.998312, 1e-6);
    const Eigen::Vector3d up_imu = q.normalized().conjugate() * Eigen::Vector3d::UnitZ();
    EXPECT_NEAR(up_imu.x(), -std::sqrt(0.5), 1e-5);
    EXPECT_NEAR(up_imu.z(), std::sqrt(0.5), 1e-5);
  }
}

TEST(L1Stream, ReportsYawWithTheErrorAskedForButMeasuresAtTheTrueOne) {
  SceneConfig scene = room();
  scene.lidar.l1.yaw_error_deg = 0.6;
  const std::vector<StreamFrame> frames = frames_of(scene, 1, 2.0);
  double square = 0.0;
  int packets = 0;
  for (const StreamFrame& frame : frames) {
    if (frame.message_id != l1::kAuxiliaryId) continue;
    const l1::Auxiliary auxiliary = l1::decode_auxiliary(payload_of(frame));
    const double truth =
        scene.lidar.l1.yaw_start_deg + 360.0 * scene.lidar.l1.yaw_rate_hz * auxiliary.packet_id / 180.0;
    const double error = std::remainder(auxiliary.yaw_start_deg - truth, 360.0);
    square += error * error;
    ++packets;
  }
  EXPECT_NEAR(std::sqrt(square / packets), 0.6, 0.1);
}

TEST(L1Stream, WritesFullPayloadsWhenToldNotToTrim) {
  SceneConfig scene = room();
  scene.lidar.l1.trim_payloads = false;
  for (const StreamFrame& frame : frames_of(scene, 1, 0.2)) {
    EXPECT_EQ(static_cast<std::size_t>(frame.bytes[1]), l1::message_info(frame.message_id)->length);
  }
}

}  // namespace
}  // namespace ignis::sim
