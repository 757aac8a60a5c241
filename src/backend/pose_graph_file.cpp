// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph_file.h"

#include <cmath>
#include <format>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

#include "common/file_output.h"

namespace ignis {
namespace {

constexpr const char* kLoopMark = "# loop";

/// Swaps the attitude and the position half of a symmetric matrix.
Matrix6d swapped_halves(const Matrix6d& m) {
  Matrix6d swapped;
  swapped << m.bottomRightCorner<3, 3>(), m.bottomLeftCorner<3, 3>(), m.topRightCorner<3, 3>(), m.topLeftCorner<3, 3>();
  return swapped;
}

void write_pose(std::ostream& out, const Pose& pose) {
  const Eigen::Vector3d& t = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  out << std::format(" {} {} {} {} {} {} {}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

void write_edge(std::ostream& out, const PoseGraphEdge& edge) {
  if (edge.is_loop) out << kLoopMark << '\n';
  out << std::format("EDGE_SE3:QUAT {} {}", edge.from, edge.to);
  write_pose(out, edge.T_from_to);
  const Matrix6d information = swapped_halves(edge.information);
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) out << std::format(" {}", information(row, column));
  }
  out << '\n';
}

/// Reads the numbers of one record; every complaint names file and line.
class RecordReader {
 public:
  RecordReader(std::string line, std::string where) : stream_(std::move(line)), where_(std::move(where)) {}

  std::string word() {
    std::string text;
    stream_ >> text;
    return text;
  }
  std::int32_t integer() {
    std::int32_t value = 0;
    if (!(stream_ >> value)) fail("a whole number is missing");
    return value;
  }
  double number() {
    double value = 0.0;
    if (!(stream_ >> value) || !std::isfinite(value)) fail("a finite number is missing");
    return value;
  }
  Pose pose() {
    Pose pose;
    for (int i = 0; i < 3; ++i) pose.translation(i) = number();
    Eigen::Vector4d xyzw;
    for (int i = 0; i < 4; ++i) xyzw(i) = number();
    const double norm = xyzw.norm();
    if (norm < 0.5 || norm > 2.0) fail("the quaternion is not of unit length");
    pose.rotation.coeffs() = xyzw;
    // Published files round to six digits; a quaternion that is already exact keeps its bits.
    if (std::abs(norm - 1.0) > 1e-15) pose.rotation.normalize();
    return pose;
  }
  Matrix6d information() {
    Matrix6d m;
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) m(row, column) = m(column, row) = number();
    }
    return swapped_halves(m);
  }
  [[noreturn]] void fail(const std::string& reason) const { throw std::runtime_error(where_ + ": " + reason); }

 private:
  std::istringstream stream_;
  std::string where_;
};

PoseGraphEdge read_edge(RecordReader& reader, const std::set<std::int32_t>& known, bool is_loop) {
  PoseGraphEdge edge;
  edge.from = reader.integer();
  edge.to = reader.integer();
  if (!known.contains(edge.from) || !known.contains(edge.to)) reader.fail("the edge names an unknown vertex");
  edge.T_from_to = reader.pose();
  edge.information = reader.information();
  edge.is_loop = is_loop;
  return edge;
}

}  // namespace

void write_pose_graph(const std::filesystem::path& file, const PoseGraph& graph) {
  FileOutput output(file);
  std::ostream& out = output.stream();
  for (const KeyframePose& vertex : graph.vertices) {
    out << std::format("VERTEX_SE3:QUAT {}", vertex.id);
    write_pose(out, vertex.T_map_body);
    out << '\n';
  }
  if (!graph.vertices.empty()) out << std::format("FIX {}\n", graph.vertices.front().id);
  for (const PoseGraphEdge& edge : graph.edges) write_edge(out, edge);
  output.commit();
}

PoseGraph read_pose_graph(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(std::format("{}: cannot be opened for reading", file.string()));
  PoseGraph graph;
  std::set<std::int32_t> known;
  std::string line;
  bool loop_follows = false;
  for (int number = 1; std::getline(in, line); ++number) {
    RecordReader reader(line, std::format("{}:{}", file.string(), number));
    const std::string tag = reader.word();
    if (tag == "VERTEX_SE3:QUAT") {
      const std::int32_t id = reader.integer();
      if (!known.insert(id).second) reader.fail(std::format("vertex {} is there twice", id));
      graph.vertices.push_back({id, reader.pose()});
    } else if (tag == "EDGE_SE3:QUAT") {
      graph.edges.push_back(read_edge(reader, known, loop_follows));
    } else if (!tag.empty() && tag[0] != '#' && tag != "FIX") {
      reader.fail("unknown record \"" + tag + '"');
    }
    loop_follows = line.starts_with(kLoopMark);
  }
  return graph;
}

}  // namespace ignis
