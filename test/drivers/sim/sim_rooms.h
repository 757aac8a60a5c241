// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "drivers/mavlink_frame.h"
#include "drivers/sim/l1_stream.h"

/// A small scene and the frames of a drive through it, for tests of the simulated sensor.
namespace ignis::sim {

/// An uneven room, driven with one bend.
inline SceneConfig room() {
  SceneConfig scene;
  scene.planes = {{.normal = {0, 1, 0}}, {.normal = {0, -1, 0}, .offset_m = -3.0}};
  scene.boxes = {{.center_m = {-4.5, 1.5, -3}, .size_m = {1, 3, 20}},
                 {.center_m = {5.5, 1.5, -3}, .size_m = {1, 3, 20}},
                 {.center_m = {0.5, 1.5, 6.5}, .size_m = {12, 3, 1}},
                 {.center_m = {0.5, 1.5, -12.5}, .size_m = {12, 3, 1}}};
  scene.trajectory.waypoints = {{.position_m = {0, 0.6, 2}, .rest_s = 1.0},
                                {.position_m = {0, 0.6, -6}},
                                {.position_m = {3.5, 0.6, -8}, .rest_s = 1.0}};
  return scene;
}

inline Extrinsics tilted_forward() {
  Extrinsics extrinsics;
  extrinsics.lidar.pitch_deg = -45.0;
  extrinsics.imu.pitch_deg = -45.0;
  extrinsics.imu.translation_m = {0.0147, -0.0007, 0.0102};
  return extrinsics;
}

inline std::vector<StreamFrame> all_frames(L1Stream& stream) {
  std::vector<StreamFrame> frames;
  while (auto frame = stream.next_frame()) frames.push_back(std::move(*frame));
  return frames;
}

inline std::vector<StreamFrame> frames_of(const SceneConfig& scene, std::uint64_t seed, double seconds,
                                          const DeviceConfig& device = {}) {
  L1Stream stream(scene, tilted_forward(), seed, seconds, device);
  return all_frames(stream);
}

inline std::span<const std::byte> payload_of(const StreamFrame& frame) {
  const auto length = static_cast<std::size_t>(frame.bytes[1]);
  return std::span(frame.bytes).subspan(l1::kHeaderSize, length);
}

inline std::vector<std::byte> bytes_of(const std::vector<StreamFrame>& frames) {
  std::vector<std::byte> bytes;
  for (const StreamFrame& frame : frames) bytes.insert(bytes.end(), frame.bytes.begin(), frame.bytes.end());
  return bytes;
}

}  // namespace ignis::sim
