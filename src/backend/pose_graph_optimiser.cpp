// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph_optimiser.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/LevenbergMarquardtOptimizer.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/PriorFactor.h>
#include <gtsam/nonlinear/Values.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <format>
#include <queue>
#include <stdexcept>
#include <unordered_map>

#include "backend/gtsam_conversion.h"
#include "backend/relative_pose_factor.h"

namespace ignis {
namespace {

using gtsam::symbol_shorthand::X;

constexpr int kFinalSteps = 3;                // Gauss-Newton steps over the whole graph once everything is in
constexpr std::size_t kFinalBatchSteps = 20;  // at most, from there
constexpr double kHoldSigma = 1e-6;
constexpr std::size_t kNamedVertices = 5;  // of those that hang in the air
constexpr std::size_t kBatchIterations = 100;
constexpr double kBatchRelativeDecrease = 1e-9;

gtsam::Key key_of(std::int32_t id) { return X(static_cast<std::uint32_t>(id)); }

boost::shared_ptr<gtsam::NonlinearFactor> factor_of(const PoseGraphEdge& edge) {
  return make_relative_pose_factor(key_of(edge.from), key_of(edge.to), edge.T_from_to, whitening(edge.information));
}

std::int32_t other_end(const PoseGraphEdge& edge, std::int32_t id) { return edge.from == id ? edge.to : edge.from; }

void add_hold(const KeyframePose& first, gtsam::NonlinearFactorGraph& factors) {
  factors.addPrior(key_of(first.id), to_gtsam(first.T_map_body), gtsam::noiseModel::Isotropic::Sigma(6, kHoldSigma));
}

std::string unreachable(const PoseGraph& graph, const std::vector<bool>& reached) {
  std::string names;
  std::size_t count = 0;
  for (std::size_t i = 0; i < reached.size(); ++i) {
    if (reached[i] || ++count > kNamedVertices) continue;
    names += std::format("{}{}", names.empty() ? "" : ", ", graph.vertices[i].id);
  }
  return std::format("no chain of edges joins vertex {} to {} of {} vertices: {}{}", graph.vertices.front().id, count,
                     reached.size(), names, count > kNamedVertices ? ", ..." : "");
}

}  // namespace

std::vector<PoseGraphOptimiser::Entry> PoseGraphOptimiser::entry_order(const PoseGraph& graph) {
  if (graph.vertices.empty()) throw std::runtime_error("the graph has no vertex");
  std::unordered_map<std::int32_t, std::size_t> place;
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) place[graph.vertices[i].id] = i;
  std::vector<std::vector<const PoseGraphEdge*>> edges(graph.vertices.size());
  for (const PoseGraphEdge& edge : graph.edges) {
    edges[place.at(edge.from)].push_back(&edge);
    edges[place.at(edge.to)].push_back(&edge);
  }
  std::vector<Entry> order;
  std::vector<bool> is_in(graph.vertices.size(), false);
  std::vector<bool> reached(graph.vertices.size(), false);
  std::priority_queue<std::size_t, std::vector<std::size_t>, std::greater<>> next;
  next.push(0);
  reached[0] = true;
  while (!next.empty()) {
    Entry entry{next.top(), {}};
    next.pop();
    for (const PoseGraphEdge* edge : edges[entry.vertex]) {
      const std::size_t other = place.at(other_end(*edge, graph.vertices[entry.vertex].id));
      if (is_in[other]) entry.edges.push_back(edge);
      if (!reached[other]) next.push(other);
      reached[other] = true;
    }
    is_in[entry.vertex] = true;
    order.push_back(std::move(entry));
  }
  if (order.size() < graph.vertices.size()) throw std::runtime_error(unreachable(graph, reached));
  return order;
}

PoseGraphOptimiser::PoseGraphOptimiser(const PoseGraph& graph, const SolverConfig& config)
    : graph_(graph), relinearize_skip_(config.relinearize_skip), order_(entry_order(graph)), solver_(config) {
  place_in_entry_.reserve(order_.size());
}

void PoseGraphOptimiser::add_next() {
  assert(!complete());
  const Entry& entry = order_[entered_];
  const std::int32_t id = graph_.vertices[entry.vertex].id;
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  if (entered_ == 0) {
    values.insert(key_of(id), to_gtsam(graph_.vertices[entry.vertex].T_map_body));
    add_hold(graph_.vertices[entry.vertex], factors);
  } else {
    const auto when_it_came = [&](const PoseGraphEdge* edge) { return place_in_entry_.at(other_end(*edge, id)); };
    const PoseGraphEdge& latest = **std::ranges::max_element(entry.edges, {}, when_it_came);
    const gtsam::Pose3 T_from_to = to_gtsam(latest.T_from_to);
    values.insert(key_of(id),
                  solver_.pose(key_of(other_end(latest, id))) * (latest.to == id ? T_from_to : T_from_to.inverse()));
    for (const PoseGraphEdge* edge : entry.edges) factors.push_back(factor_of(*edge));
  }
  const SolverOutcome outcome = solver_.add(factors, values);
  if (!outcome.accepted) throw std::runtime_error(std::format("vertex {}: {}", id, outcome.reason));
  place_in_entry_[id] = entered_++;
}

PoseGraphSolution PoseGraphOptimiser::finish() {
  assert(complete());
  solver_.settle(kFinalSteps * relinearize_skip_);
  PoseGraph settled = graph_;
  for (KeyframePose& vertex : settled.vertices) vertex.T_map_body = from_gtsam(solver_.pose(key_of(vertex.id)));
  // Linearisation points may still lie within the solver's thresholds of where they should be.
  return optimise_in_batch(settled, [](std::size_t iteration, double) { return iteration < kFinalBatchSteps; });
}

PoseGraphSolution optimise_pose_graph(const PoseGraph& graph, const SolverConfig& config) {
  PoseGraphOptimiser optimiser(graph, config);
  while (!optimiser.complete()) optimiser.add_next();
  return optimiser.finish();
}

PoseGraphSolution optimise_in_batch(const PoseGraph& graph, const BatchObserver& observer) {
  PoseGraphSolution solution;
  if (graph.vertices.empty()) return solution;
  gtsam::NonlinearFactorGraph edges;
  gtsam::Values values;
  for (const KeyframePose& vertex : graph.vertices) values.insert(key_of(vertex.id), to_gtsam(vertex.T_map_body));
  for (const PoseGraphEdge& edge : graph.edges) edges.push_back(factor_of(edge));
  gtsam::NonlinearFactorGraph held = edges;
  add_hold(graph.vertices.front(), held);
  gtsam::LevenbergMarquardtOptimizer optimiser(held, values);
  double before = optimiser.error();
  while (optimiser.iterations() < kBatchIterations) {
    optimiser.iterate();
    const double now = optimiser.error();
    if (!observer(optimiser.iterations(), now)) break;
    if (before - now <= kBatchRelativeDecrease * before) break;
    before = now;
  }
  for (const KeyframePose& vertex : graph.vertices) {
    solution.poses.push_back({vertex.id, from_gtsam(optimiser.values().at<gtsam::Pose3>(key_of(vertex.id)))});
  }
  solution.half_chi_square = edges.error(optimiser.values());
  return solution;
}

}  // namespace ignis
