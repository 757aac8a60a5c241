// SPDX-License-Identifier: Apache-2.0
#include "graph_study.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/PriorFactor.h>
#include <gtsam/nonlinear/Values.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <format>
#include <random>
#include <stdexcept>

#include "aligned_error.h"
#include "backend/factors/gtsam_conversion.h"
#include "backend/factors/relative_pose_factor.h"
#include "backend/keyframes/odometry_chain.h"
#include "backend/loops/loop_consistency.h"
#include "backend/pose_graph/pose_graph_optimiser.h"
#include "graph_court.h"
#include "process_cost.h"

namespace ignis::bench {
namespace {

constexpr unsigned kRedrawn = 5;     // graphs whose errors are drawn anew
constexpr double kTellable = 0.999;  // a wrong loop counts beyond this quantile
constexpr std::size_t kBatchSteps = 50;
constexpr double kHoldSigma = 1e-6;

gtsam::Key key_of(std::int32_t id) { return gtsam::symbol_shorthand::X(static_cast<std::uint32_t>(id)); }

/// Seen from its earlier pose, so that `to` is the later one.
PoseGraphEdge forward(const PoseGraphEdge& edge) {
  if (edge.from < edge.to) return edge;
  const Matrix6d back = adjoint(edge.T_from_to.inverse());
  return {edge.to, edge.from, edge.T_from_to.inverse(), back.transpose() * edge.information * back, edge.is_loop};
}

std::vector<Pose> optimum_of(const PoseGraph& graph) {
  const PoseGraphSolution solution =
      optimise_in_batch(graph, [](std::size_t iteration, double) { return iteration < kBatchSteps; });
  std::vector<Pose> poses;
  for (const KeyframePose& pose : solution.poses) poses.push_back(pose.T_map_body);
  return poses;
}

void place(PoseGraph& graph, const std::vector<Pose>& poses) {
  for (std::size_t i = 0; i < poses.size(); ++i) graph.vertices[i].T_map_body = poses[i];
}

/// A solver that holds the whole graph, linearised at its poses.
IncrementalSolver solver_at(const PoseGraph& graph) {
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  factors.addPrior(key_of(0), to_gtsam(graph.vertices.front().T_map_body),
                   gtsam::noiseModel::Isotropic::Sigma(6, kHoldSigma));
  for (const KeyframePose& vertex : graph.vertices) values.insert(key_of(vertex.id), to_gtsam(vertex.T_map_body));
  for (const PoseGraphEdge& edge : graph.edges) {
    factors.push_back(
        make_relative_pose_factor(key_of(edge.from), key_of(edge.to), edge.T_from_to, whitening(edge.information)));
  }
  IncrementalSolver solver{SolverConfig()};
  if (const SolverOutcome outcome = solver.add(factors, values); !outcome.accepted) {
    throw std::runtime_error(outcome.reason);
  }
  return solver;
}

/// The graph with edges that are off from its poses by errors as large as they claim.
PoseGraph redrawn(PoseGraph graph, std::mt19937& random) {
  std::normal_distribution<double> unit;
  for (PoseGraphEdge& edge : graph.edges) {
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(edge.information);
    Vector6d error;
    for (int i = 0; i < 6; ++i) error(i) = unit(random) / std::sqrt(eigen.eigenvalues()(i));
    const Pose& T_map_from = graph.vertices[static_cast<std::size_t>(edge.from)].T_map_body;
    const Pose& T_map_to = graph.vertices[static_cast<std::size_t>(edge.to)].T_map_body;
    edge.T_from_to = perturbed_in_body(T_map_from.inverse() * T_map_to, eigen.eigenvectors() * error);
  }
  return graph;
}

double expected_error(const PoseGraph& optimal, const std::vector<Pose>& optimum) {
  std::mt19937 random(1);
  double squares = 0.0;
  for (unsigned i = 0; i < kRedrawn; ++i) {
    const double error = aligned_error(optimum_of(redrawn(optimal, random)), optimum);
    squares += error * error / kRedrawn;
  }
  return std::sqrt(squares);
}

/// Which of the wrong loops the optimum contradicts, by its covariance and theirs. The others are as good as true.
std::vector<bool> contradicted(const GraphStudy& study, const std::vector<StudyLoop>& loops) {
  const IncrementalSolver solver = solver_at(study.optimal);
  const double bound = ChiSquareBounds(kTellable).of(6);
  std::vector<bool> contradicted;
  for (const auto& [loop, is_true] : loops) {
    const std::pair<std::uint64_t, std::uint64_t> ends(key_of(loop.to_id), key_of(loop.from_id));
    const Matrix6d covariance = loop.information.inverse() + solver.relative_covariance({&ends, 1});
    const Pose& T_map_to = study.drive.T_world_body[static_cast<std::size_t>(loop.to_id)];
    const Pose& T_map_from = study.drive.T_world_body[static_cast<std::size_t>(loop.from_id)];
    const Vector6d error = body_difference(loop.T_to_from, T_map_to.inverse() * T_map_from);
    contradicted.push_back(!is_true && error.dot(covariance.ldlt().solve(error)) > bound);
  }
  return contradicted;
}

}  // namespace

GraphStudy graph_study(PoseGraph graph, std::size_t poses, double information_scale) {
  GraphStudy study;
  poses = std::min(poses, graph.vertices.size());
  graph.vertices.resize(poses);
  study.steps.resize(poses - 1);
  std::vector<bool> is_there(poses - 1, false);
  for (std::size_t i = 0; i < poses; ++i) {
    if (graph.vertices[i].id != static_cast<std::int32_t>(i)) throw std::runtime_error("poses must be 0, 1, 2 ...");
  }
  std::erase_if(graph.edges, [&](const PoseGraphEdge& edge) {
    return static_cast<std::size_t>(std::max(edge.from, edge.to)) >= poses;
  });
  for (PoseGraphEdge& edge : graph.edges) {
    edge = forward(edge);
    edge.information *= information_scale;
    const auto from = static_cast<std::size_t>(edge.from);
    if (edge.to == edge.from + 1 && !is_there[from]) {
      study.steps[from] = edge;
      is_there[from] = true;
    } else {
      study.drive.loops.push_back({edge.to, edge.from, edge.T_from_to, edge.information});
    }
  }
  const auto missing = std::ranges::find(is_there, false);
  if (missing != is_there.end()) {
    throw std::runtime_error(std::format("no edge from pose {} to the next", missing - is_there.begin()));
  }
  std::ranges::stable_sort(study.drive.loops, {}, &LoopMeasurement::from_id);
  // The file's poses may be a bad start; the incremental solver's end is not.
  SolverConfig coarse;
  coarse.relinearize_position_m = coarse.relinearize_rotation_rad = 0.1;
  coarse.relinearize_skip = 10;
  coarse.wildfire_threshold = 1e-3;
  for (const KeyframePose& pose : optimise_pose_graph(graph, coarse).poses) {
    study.drive.T_world_body.push_back(pose.T_map_body);
  }
  place(graph, study.drive.T_world_body);
  study.clean_ate_m = expected_error(graph, study.drive.T_world_body);
  study.optimal = std::move(graph);
  return study;
}

GraphOutcome judged(const GraphStudy& study, const std::vector<StudyLoop>& loops, const BackendConfig& config) {
  GraphCourt court(config);
  court.begin(study.drive.T_world_body.front());
  std::vector<double> times_ms;
  std::size_t next = 0;
  for (const PoseGraphEdge& step : study.steps) {
    const double began = processor_ms();
    court.add(step);
    for (; next < loops.size() && loops[next].measurement.from_id == step.to; ++next)
      court.judge(loops[next].measurement);
    times_ms.push_back(processor_ms() - began);
  }
  GraphOutcome outcome;
  const std::vector<bool> is_false = contradicted(study, loops);
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const bool kept = court.holds(static_cast<std::int32_t>(i));
    if (loops[i].is_true) {
      ++outcome.true_tried;
      outcome.true_kept += kept ? 1 : 0;
    } else if (is_false[i]) {
      ++outcome.false_tried;
      outcome.false_kept += kept ? 1 : 0;
    }
  }
  outcome.from_clean_m = aligned_error(court.poses(), study.drive.T_world_body);
  const double relative = outcome.from_clean_m / study.clean_ate_m;
  outcome.ate_ratio = std::sqrt(1.0 + relative * relative);
  outcome.p99_ms = quantile(times_ms, 0.99);
  return outcome;
}

}  // namespace ignis::bench
