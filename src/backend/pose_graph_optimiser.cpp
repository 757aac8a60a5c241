// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph_optimiser.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/PriorFactor.h>
#include <gtsam/nonlinear/Values.h>

#include <algorithm>
#include <format>
#include <map>
#include <stdexcept>

#include "backend/gtsam_conversion.h"
#include "backend/relative_pose_factor.h"

namespace ignis {
namespace {

using gtsam::symbol_shorthand::X;

constexpr int kFinalSteps = 3;  // Gauss-Newton steps over the whole graph once everything is in
constexpr double kHoldSigma = 1e-6;

/// Edges by the later of their two ends (in vertex order).
using EdgesByLater = std::map<std::size_t, std::vector<const PoseGraphEdge*>>;

struct Indexed {
  std::map<std::int32_t, std::size_t> place;  ///< of a vertex id
  EdgesByLater edges;
};

Indexed index(const PoseGraph& graph) {
  Indexed indexed;
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) indexed.place[graph.vertices[i].id] = i;
  for (const PoseGraphEdge& edge : graph.edges) {
    indexed.edges[std::max(indexed.place.at(edge.from), indexed.place.at(edge.to))].push_back(&edge);
  }
  return indexed;
}

/// First guess of vertex `i` through the edge whose other end is the most recent one.
gtsam::Pose3 first_guess(std::size_t i, const std::vector<const PoseGraphEdge*>& edges, const Indexed& indexed,
                         const IncrementalSolver& solver) {
  const auto other_end = [&](const PoseGraphEdge* edge) {
    return std::min(indexed.place.at(edge->from), indexed.place.at(edge->to));
  };
  const PoseGraphEdge* edge = *std::ranges::max_element(edges, {}, other_end);
  const gtsam::Pose3 T_map_other = solver.pose(X(other_end(edge)));
  const gtsam::Pose3 T_from_to = to_gtsam(edge->T_from_to);
  return T_map_other * (indexed.place.at(edge->to) == i ? T_from_to : T_from_to.inverse());
}

}  // namespace

PoseGraphSolution optimise_pose_graph(const PoseGraph& graph, const SolverConfig& config) {
  PoseGraphSolution solution;
  if (graph.vertices.empty()) return solution;
  const Indexed indexed = index(graph);
  IncrementalSolver solver(config);
  FactorId hold = 0;
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
    gtsam::NonlinearFactorGraph factors;
    gtsam::Values values;
    if (i == 0) {
      const gtsam::Pose3 T_map_first = to_gtsam(graph.vertices[0].T_map_body);
      values.insert(X(0), T_map_first);
      factors.addPrior(X(0), T_map_first, gtsam::noiseModel::Isotropic::Sigma(6, kHoldSigma));
    } else {
      const auto edges = indexed.edges.find(i);
      if (edges == indexed.edges.end()) {
        throw std::runtime_error(std::format("vertex {} has no edge to an earlier one", graph.vertices[i].id));
      }
      values.insert(X(i), first_guess(i, edges->second, indexed, solver));
      for (const PoseGraphEdge* edge : edges->second) {
        factors.push_back(make_relative_pose_factor(X(indexed.place.at(edge->from)), X(indexed.place.at(edge->to)),
                                                    edge->T_from_to, whitening(edge->information)));
      }
    }
    const SolverOutcome outcome = solver.add(factors, values);
    if (!outcome.accepted) throw std::runtime_error(std::format("vertex {}: {}", graph.vertices[i].id, outcome.reason));
    if (i == 0) hold = outcome.factors.front();
  }
  solver.settle(kFinalSteps * config.relinearize_skip);
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
    solution.poses.push_back({graph.vertices[i].id, from_gtsam(solver.pose(X(i)))});
  }
  solution.half_chi_square = solver.half_chi_square() - solver.half_chi_square(hold);
  return solution;
}

}  // namespace ignis
