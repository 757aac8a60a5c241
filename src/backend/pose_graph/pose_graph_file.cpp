// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/pose_graph_file.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <deque>
#include <format>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_set>

#include "common/file_output.h"

namespace ignis {
namespace {

constexpr const char* kLoopMark = "# loop";
constexpr const char* kVertex = "VERTEX_SE3:QUAT";
constexpr const char* kEdge = "EDGE_SE3:QUAT";
constexpr const char* kPlanarVertex = "VERTEX_SE2";
constexpr const char* kPlanarEdge = "EDGE_SE2";
constexpr const char* kParameters = "PARAMS_";  // of records other than these, which are refused
constexpr const char* kByteOrderMark = "\xEF\xBB\xBF";
constexpr double kRounding = 1e-6;  // of published files, relative to the largest eigenvalue

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

double heading_of(const Pose& pose) { return 2.0 * std::atan2(pose.rotation.z(), pose.rotation.w()); }

void write_planar_pose(std::ostream& out, const Pose& pose) {
  out << std::format(" {} {} {}", pose.translation.x(), pose.translation.y(), heading_of(pose));
}

template <int kSize>
void write_upper_triangle(std::ostream& out, const Eigen::Matrix<double, kSize, kSize>& information) {
  for (int row = 0; row < kSize; ++row) {
    for (int column = row; column < kSize; ++column) out << std::format(" {}", information(row, column));
  }
  out << '\n';
}

void write_edge(std::ostream& out, const PoseGraphEdge& edge, bool planar) {
  if (edge.is_loop) out << kLoopMark << '\n';
  out << std::format("{} {} {}", planar ? kPlanarEdge : kEdge, edge.from, edge.to);
  if (planar) {
    write_planar_pose(out, edge.T_from_to);
    const std::array<int, 3> x_y_heading{3, 4, 2};
    write_upper_triangle<3>(out, edge.information(x_y_heading, x_y_heading));
  } else {
    write_pose(out, edge.T_from_to);
    write_upper_triangle<6>(out, swapped_halves(edge.information));
  }
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
    if (!(stream_ >> value)) fail("a whole number of 32 bits is missing");
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
  Pose planar_pose() {
    Pose pose;
    for (int i = 0; i < 2; ++i) pose.translation(i) = number();
    pose.rotation = Eigen::AngleAxisd(number(), Eigen::Vector3d::UnitZ());
    return pose;
  }
  Matrix6d information() { return swapped_halves(upper_triangle<6>()); }
  Matrix6d planar_information() {
    const Eigen::Matrix3d known = upper_triangle<3>();
    Matrix6d information = known.diagonal().maxCoeff() * Matrix6d::Identity();
    const std::array<int, 3> x_y_heading{3, 4, 2};
    information(x_y_heading, x_y_heading) = known;
    return information;
  }
  void end() {
    if (!word().empty()) fail("the record is too long");
  }
  [[noreturn]] void fail(const std::string& reason) const { throw std::runtime_error(where_ + ": " + reason); }

 private:
  template <int kSize>
  Eigen::Matrix<double, kSize, kSize> upper_triangle() {
    Eigen::Matrix<double, kSize, kSize> m;
    for (int row = 0; row < kSize; ++row) {
      for (int column = row; column < kSize; ++column) m(row, column) = m(column, row) = number();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, kSize, kSize>> eigen(m, Eigen::EigenvaluesOnly);
    const auto& eigenvalues = eigen.eigenvalues();  // ascending
    if (eigenvalues(0) < -kRounding * eigenvalues(kSize - 1)) fail("the information has a negative direction");
    return m;
  }

  std::istringstream stream_;
  std::string where_;
};

PoseGraphEdge read_edge(RecordReader& reader, bool planar, bool is_loop) {
  PoseGraphEdge edge;
  edge.from = reader.integer();
  edge.to = reader.integer();
  if (edge.from == edge.to) reader.fail(std::format("the edge joins vertex {} to itself", edge.to));
  edge.T_from_to = planar ? reader.planar_pose() : reader.pose();
  edge.information = planar ? reader.planar_information() : reader.information();
  edge.is_loop = is_loop;
  return edge;
}

/// The ends of all edges, ascending, where the edges put them: from the least known one on, breadth first.
std::vector<KeyframePose> ends_of(const std::vector<PoseGraphEdge>& edges) {
  std::map<std::int32_t, std::vector<const PoseGraphEdge*>> edges_at;
  for (const PoseGraphEdge& edge : edges) {
    edges_at[edge.from].push_back(&edge);
    edges_at[edge.to].push_back(&edge);
  }
  std::map<std::int32_t, Pose> placed;
  for (const auto& [first, unused] : edges_at) {
    if (!placed.try_emplace(first).second) continue;
    std::deque<std::int32_t> open{first};
    for (; !open.empty(); open.pop_front()) {
      const std::int32_t at = open.front();
      for (const PoseGraphEdge* edge : edges_at.at(at)) {
        const bool is_ahead = edge->from == at;
        const Pose T_at_other = is_ahead ? edge->T_from_to : edge->T_from_to.inverse();
        const std::int32_t other = is_ahead ? edge->to : edge->from;
        if (placed.try_emplace(other, placed.at(at) * T_at_other).second) open.push_back(other);
      }
    }
  }
  std::vector<KeyframePose> ends;
  for (const auto& [id, T_map_body] : placed) ends.push_back({id, T_map_body});
  return ends;
}

/// Reads record after record into a graph.
class GraphReader {
 public:
  explicit GraphReader(std::string file) : file_(std::move(file)) {}

  void read(std::string line) {
    if (++line_ == 1 && line.starts_with(kByteOrderMark)) line.erase(0, std::string_view(kByteOrderMark).size());
    RecordReader reader(line, where(line_));
    const std::string tag = reader.word();
    if (tag == kVertex || tag == kPlanarVertex) {
      note_kind(tag == kPlanarVertex, reader);
      read_vertex(reader);
    } else if (tag == kEdge || tag == kPlanarEdge) {
      note_kind(tag == kPlanarEdge, reader);
      graph_.edges.push_back(read_edge(reader, graph_.planar, loop_follows_));
      edge_lines_.push_back(line_);
    } else if (!tag.empty() && tag[0] != '#' && tag != "FIX" && !tag.starts_with(kParameters)) {
      reader.fail("unknown record \"" + tag + '"');
    }
    if (tag.contains("_SE") && tag[0] != '#' && !tag.starts_with(kParameters)) reader.end();
    loop_follows_ = line.starts_with(kLoopMark);
  }

  PoseGraph finish() {
    if (graph_.vertices.empty()) {
      graph_.vertices = ends_of(graph_.edges);
      return std::move(graph_);
    }
    for (std::size_t i = 0; i < graph_.edges.size(); ++i) {
      for (const std::int32_t id : {graph_.edges[i].from, graph_.edges[i].to}) {
        if (known_.contains(id)) continue;
        throw std::runtime_error(std::format("{}: the edge names an unknown vertex, {}", where(edge_lines_[i]), id));
      }
    }
    return std::move(graph_);
  }

 private:
  [[nodiscard]] std::string where(int line) const { return std::format("{}:{}", file_, line); }

  void note_kind(bool planar, const RecordReader& reader) {
    const bool is_first = graph_.vertices.empty() && graph_.edges.empty();
    if (!is_first && planar != graph_.planar) reader.fail("SE2 and SE3 records are mixed");
    graph_.planar = planar;
  }

  void read_vertex(RecordReader& reader) {
    const std::int32_t id = reader.integer();
    if (!known_.insert(id).second) reader.fail(std::format("vertex {} is there twice", id));
    graph_.vertices.push_back({id, graph_.planar ? reader.planar_pose() : reader.pose()});
  }

  std::string file_;
  PoseGraph graph_;
  std::unordered_set<std::int32_t> known_;
  std::vector<int> edge_lines_;
  int line_ = 0;
  bool loop_follows_ = false;
};

}  // namespace

void write_pose_graph(std::ostream& out, const PoseGraph& graph) {
  for (const KeyframePose& vertex : graph.vertices) {
    out << std::format("{} {}", graph.planar ? kPlanarVertex : kVertex, vertex.id);
    graph.planar ? write_planar_pose(out, vertex.T_map_body) : write_pose(out, vertex.T_map_body);
    out << '\n';
  }
  if (!graph.vertices.empty()) out << std::format("FIX {}\n", graph.vertices.front().id);
  for (const PoseGraphEdge& edge : graph.edges) write_edge(out, edge, graph.planar);
}

void write_pose_graph(const std::filesystem::path& file, const PoseGraph& graph) {
  FileOutput output(file);
  write_pose_graph(output.stream(), graph);
  output.commit();
}

PoseGraph read_pose_graph(std::istream& in, const std::string& name) {
  GraphReader reader(name);
  std::string line;
  while (std::getline(in, line)) reader.read(line);
  return reader.finish();
}

PoseGraph read_pose_graph(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(std::format("{}: cannot be opened for reading", file.string()));
  return read_pose_graph(in, file.string());
}

}  // namespace ignis
