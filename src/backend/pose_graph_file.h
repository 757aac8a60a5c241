// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "backend/keyframe_pose.h"
#include "common/pose.h"

namespace ignis {

/// A relative pose between two vertices: T_from_to, information attitude then position in body axes of `to`.
struct PoseGraphEdge {
  std::int32_t from = 0;
  std::int32_t to = 0;
  Pose T_from_to;
  Matrix6d information = Matrix6d::Zero();
  bool is_loop = false;
};

/// Poses and relative poses alone: what other tools can read of a graph.
struct PoseGraph {
  std::vector<KeyframePose> vertices;
  std::vector<PoseGraphEdge> edges;
};

/// Writes g2o text: VERTEX_SE3:QUAT, FIX for the first vertex, EDGE_SE3:QUAT with translation first in the information.
/// A loop is marked by a comment line "# loop" before its edge. Numbers read back bit for bit. Appears under its name
/// only when complete; throws std::runtime_error naming the path.
void write_pose_graph(const std::filesystem::path& file, const PoseGraph& graph);

/// Reads what write_pose_graph writes and the published graphs of that format. Throws std::runtime_error naming file,
/// line and reason: unknown record, missing or non-finite number, zero quaternion, edge to an unknown vertex.
[[nodiscard]] PoseGraph read_pose_graph(const std::filesystem::path& file);

}  // namespace ignis
