// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/pose_graph_optimiser.h"

#include <gtsam/nonlinear/LevenbergMarquardtOptimizer.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <format>
#include <queue>
#include <stdexcept>
#include <unordered_map>

#include "backend/pose_graph/chordal_start.h"
#include "backend/pose_graph/lifted_start.h"

namespace ignis {
namespace {

constexpr int kFinalSteps = 3;                // Gauss-Newton steps over the whole graph once everything is in
constexpr std::size_t kFinalBatchSteps = 50;  // at most, from there
constexpr double kSameMinimum = 1e-6;         // relative difference of two costs that is none
constexpr double kRoundingPerEdge = 1e-9;     // of half chi-square
constexpr std::size_t kNamedVertices = 5;     // of those that hang in the air
constexpr std::size_t kBatchIterations = 100;
constexpr double kBatchRelativeDecrease = 1e-9;

std::int32_t other_end(const PoseGraphEdge& edge, std::int32_t id) { return edge.from == id ? edge.to : edge.from; }

/// Levenberg-Marquardt from `values` until it goes no lower or `goes_on` says no; then false.
bool descend(gtsam::NonlinearFactorGraph factors, const gtsam::NonlinearFactor::shared_ptr& hold, gtsam::Values& values,
             const std::function<bool(double)>& goes_on) {
  factors.push_back(hold);
  gtsam::LevenbergMarquardtOptimizer optimiser(factors, values);
  double before = optimiser.error();
  bool is_wanted = true;
  while (is_wanted && optimiser.iterations() < kBatchIterations) {
    optimiser.iterate();
    const double now = optimiser.error();
    is_wanted = goes_on(now);
    if (before - now <= kBatchRelativeDecrease * before) break;
    before = now;
  }
  values = optimiser.values();
  return is_wanted;
}

/// Batch steps for a while.
PoseGraphSolution settled(const PoseGraph& graph, PoseGraphStart start, const SettlingObserver& observer) {
  PoseGraphSolution solution = optimise_in_batch(
      graph, [&](std::size_t iteration, double) { return observer(start) && iteration < kFinalBatchSteps; });
  solution.start = start;
  return solution;
}

/// By more than rounding makes of it: relative, and absolute where edges are met exactly.
bool is_lower(const PoseGraphSolution& a, const PoseGraphSolution& b, std::size_t edges) {
  const double rounding = kSameMinimum * b.half_chi_square + kRoundingPerEdge * static_cast<double>(edges);
  return a.half_chi_square < b.half_chi_square - rounding;
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

std::string_view words_of(PoseGraphStart start) {
  switch (start) {
    case PoseGraphStart::kStoredPoses:
      return "the stored poses";
    case PoseGraphStart::kPoseByPose:
      return "pose by pose";
    case PoseGraphStart::kChordalRelaxation:
      return "the chordal relaxation";
    case PoseGraphStart::kLiftedDescent:
      return "the lifted descent";
  }
  return "";
}

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
    : graph_(graph),
      variables_(graph.planar),
      relinearize_skip_(config.relinearize_skip),
      order_(entry_order(graph)),
      solver_(config) {
  place_in_entry_.reserve(order_.size());
}

void PoseGraphOptimiser::add_next() {
  assert(!complete());
  const Entry& entry = order_[entered_];
  const KeyframePose& vertex = graph_.vertices[entry.vertex];
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  if (entered_ == 0) {
    variables_.insert(vertex.id, vertex.T_map_body, values);
    factors.push_back(variables_.hold_of(vertex));
  } else {
    const auto when_it_came = [&](const PoseGraphEdge* edge) {
      return place_in_entry_.at(other_end(*edge, vertex.id));
    };
    const PoseGraphEdge& latest = **std::ranges::max_element(entry.edges, {}, when_it_came);
    const Pose T_known_new = latest.to == vertex.id ? latest.T_from_to : latest.T_from_to.inverse();
    variables_.insert(vertex.id, pose(other_end(latest, vertex.id)) * T_known_new, values);
    for (const PoseGraphEdge* edge : entry.edges) factors.push_back(variables_.factor_of(*edge));
  }
  const SolverOutcome outcome = solver_.add(factors, values);
  if (!outcome.accepted) throw std::runtime_error(std::format("vertex {}: {}", vertex.id, outcome.reason));
  place_in_entry_[vertex.id] = entered_++;
}

Pose PoseGraphOptimiser::pose(std::int32_t id) {
  const std::uint64_t key = variables_.key_of(id);
  return variables_.pose_in(solver_.estimate_of(std::span(&key, 1)), id);
}

PoseGraphSolution PoseGraphOptimiser::finish(const SettlingObserver& observer) {
  assert(complete());
  solver_.settle(kFinalSteps * relinearize_skip_);
  PoseGraph start = graph_;
  for (KeyframePose& vertex : start.vertices) vertex.T_map_body = pose(vertex.id);
  // Linearisation points may still lie within the solver's thresholds of where they should be.
  PoseGraphSolution best = settled(start, PoseGraphStart::kPoseByPose, observer);
  try {
    try_further_starts(best, observer);
  } catch (const std::exception& error) {
    best.given_up = error.what();
  }
  return best;
}

/// Leaves the solution of lowest cost in `best`, whatever ends the work.
void PoseGraphOptimiser::try_further_starts(PoseGraphSolution& best, const SettlingObserver& observer) const {
  PoseGraph start = graph_;
  start.vertices = chordal_start(graph_);
  if (start.vertices.empty() || !observer(PoseGraphStart::kChordalRelaxation)) return;
  PoseGraphSolution relaxed = settled(start, PoseGraphStart::kChordalRelaxation, observer);
  const std::size_t edges = graph_.edges.size();
  if (!is_lower(best, relaxed, edges) && !is_lower(relaxed, best, edges)) return;
  if (is_lower(relaxed, best, edges)) best = std::move(relaxed);
  const auto goes_on = [&] { return observer(PoseGraphStart::kLiftedDescent); };
  start.vertices = lifted_start(graph_, start.vertices, goes_on);
  if (start.vertices.empty()) return;
  PoseGraphSolution lifted = settled(start, PoseGraphStart::kLiftedDescent, observer);
  if (is_lower(lifted, best, edges)) best = std::move(lifted);
}

PoseGraphSolution optimise_pose_graph(const PoseGraph& graph, const SolverConfig& config) {
  PoseGraphOptimiser optimiser(graph, config);
  while (!optimiser.complete()) optimiser.add_next();
  return optimiser.finish([](PoseGraphStart) { return true; });
}

PoseGraphSolution optimise_in_batch(const PoseGraph& graph, const BatchObserver& observer) {
  PoseGraphSolution solution;
  if (graph.vertices.empty()) return solution;
  const PoseGraphVariables variables(graph.planar);
  gtsam::Values values;
  for (const KeyframePose& vertex : graph.vertices) variables.insert(vertex.id, vertex.T_map_body, values);
  gtsam::NonlinearFactorGraph factors;
  gtsam::NonlinearFactorGraph costs;
  for (const PoseGraphEdge& edge : graph.edges) {
    factors.push_back(variables.factor_of(edge));
    costs.push_back(variables.cost_of(edge));
  }
  const auto hold = variables.hold_of(graph.vertices.front());
  std::size_t iterations = 0;
  const auto count = [&](double half_chi_square) { return observer(++iterations, half_chi_square); };
  const bool goes_on = descend(factors, hold, values, count);
  if (goes_on && graph.planar) descend(costs, hold, values, count);
  for (const KeyframePose& vertex : graph.vertices) {
    solution.poses.push_back({vertex.id, variables.pose_in(values, vertex.id)});
  }
  solution.half_chi_square = costs.error(values);
  return solution;
}

}  // namespace ignis
