// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
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
  bool planar = false;  ///< all of it lies in the plane z = 0, rotations about z: read from SE2 records
};

/// Writes g2o text: VERTEX_SE3:QUAT, FIX for the first vertex, EDGE_SE3:QUAT with translation first in the information.
/// A planar graph leaves as VERTEX_SE2 and EDGE_SE2. A loop is marked by a comment line "# loop" before its edge.
/// Numbers of SE3 records read back bit for bit. Appears under its name only when complete; throws std::runtime_error
/// naming the path.
void write_pose_graph(const std::filesystem::path& file, const PoseGraph& graph);
void write_pose_graph(std::ostream& out, const PoseGraph& graph);

/// Reads what write_pose_graph writes and the published graphs of that format, vertices and edges in any order. Where a
/// file has no vertex at all, these are the ends of its edges, ascending, placed along them. FIX and PARAMS_ records
/// are passed over. In a planar graph the three directions that SE2 does not know are held as tightly as the tightest
/// that it knows. Throws std::runtime_error naming file, line and reason: unknown record, SE2 mixed with SE3, missing
/// or non-finite number, a number too many, zero quaternion, information with a negative direction, edge to an unknown
/// vertex or to itself.
[[nodiscard]] PoseGraph read_pose_graph(const std::filesystem::path& file);
/// The same from a stream; `name` stands for the file in messages.
[[nodiscard]] PoseGraph read_pose_graph(std::istream& in, const std::string& name);

}  // namespace ignis
