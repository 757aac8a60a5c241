// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/pose.h"
#include "map/three_level_map.h"

namespace ignis {

/// Version of the frame below: the WebSocket subprotocol that server and client agree on.
inline constexpr char kStreamProtocol[] = "ignis.lio_map.v1";

inline constexpr std::size_t kStreamHeaderBytes = 76;
inline constexpr std::size_t kVoxelRecordBytes = 8;

/// What one frame of the stream shows. Positions [m] in frame map.
struct StreamFrame {
  Pose T_map_body;
  MapView levels;
  std::vector<Eigen::Vector3f> odometry_path;
  std::vector<Eigen::Vector3f> corrected_path;
  std::vector<std::pair<Eigen::Vector3f, Eigen::Vector3f>> loop_edges;
};

/// Encodes a frame as docs/wire_format.md lays it out: little-endian, every item on a 4-byte boundary. Voxels whose
/// cell does not fit 16 bits relative to the level's origin are left out; MapConfig's rules make that impossible.
[[nodiscard]] std::string encode_frame(const StreamFrame& frame);

}  // namespace ignis
