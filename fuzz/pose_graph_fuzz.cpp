// SPDX-License-Identifier: Apache-2.0
//
// Pose graphs from strangers under a coverage-guided fuzzer: a file is read as a whole or refused with its line, and
// what was read is finite, joined and survives being written and read again.

#include <cstdlib>
#include <sstream>
#include <stdexcept>
#include <string>
#include <unordered_set>

#include "backend/pose_graph/pose_graph_file.h"

namespace {

using namespace ignis;

void require(bool holds) {
  if (!holds) std::abort();
}

PoseGraph parse(const std::string& text) {
  std::istringstream stream(text);
  return read_pose_graph(stream, "input");
}

void check(const PoseGraph& graph) {
  std::unordered_set<std::int32_t> ids;
  for (const KeyframePose& vertex : graph.vertices) {
    require(vertex.T_map_body.all_finite());
    require(std::abs(vertex.T_map_body.rotation.norm() - 1.0) < 1e-9);
    require(ids.insert(vertex.id).second);
  }
  for (const PoseGraphEdge& edge : graph.edges) {
    require(edge.T_from_to.all_finite() && edge.information.allFinite());
    require(edge.from != edge.to && ids.contains(edge.from) && ids.contains(edge.to));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  PoseGraph graph;
  try {
    graph = parse(std::string(data, data + size));
  } catch (const std::runtime_error&) {
    return 0;
  }
  check(graph);
  std::ostringstream written;
  write_pose_graph(written, graph);
  const PoseGraph again = parse(written.str());
  check(again);
  require(again.vertices.size() == graph.vertices.size() && again.edges.size() == graph.edges.size());
  return 0;
}
