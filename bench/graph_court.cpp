// SPDX-License-Identifier: Apache-2.0
#include "graph_court.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/PriorFactor.h>
#include <gtsam/nonlinear/Values.h>

#include <algorithm>
#include <format>
#include <stdexcept>

#include "backend/factors/gtsam_conversion.h"
#include "backend/factors/relative_pose_factor.h"
#include "backend/keyframes/revision_report.h"
#include "backend/loops/loop_admission.h"

namespace ignis::bench {
namespace {

using gtsam::symbol_shorthand::X;

constexpr double kHoldSigma = 1e-6;

}  // namespace

void GraphCourt::begin(const Pose& T_map_body) {
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  factors.addPrior(X(0), to_gtsam(T_map_body), gtsam::noiseModel::Isotropic::Sigma(6, kHoldSigma));
  values.insert(X(0), to_gtsam(T_map_body));
  static_cast<void>(solver_.add(factors, values));
  GraphNode node;
  node.end.filter.T_odom_body = T_map_body;
  append(std::move(node));
}

void GraphCourt::add(const PoseGraphEdge& step) {
  GraphNode node;
  node.end.id = step.to;
  node.end.filter.T_odom_body = state_.nodes.back().end.filter.T_odom_body * step.T_from_to;
  node.odometry = whitening(step.information);
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  factors.push_back(make_relative_pose_factor(X(step.from), X(step.to), step.T_from_to, node.odometry));
  values.insert(X(step.to), solver_.pose(X(step.from)) * to_gtsam(step.T_from_to));
  const SolverOutcome outcome = solver_.add(factors, values);
  if (!outcome.accepted) throw std::runtime_error(std::format("pose {}: {}", step.to, outcome.reason));
  append(std::move(node));
  static_cast<void>(review_loops(config_, solver_, state_));
}

void GraphCourt::judge(const LoopMeasurement& loop) {
  LoopResult result;
  result.from_id = loop.from_id;
  result.to_id = loop.to_id;
  result.T_to_from = loop.T_to_from;
  follow_nodes(state_, config_);
  static_cast<void>(admit_loop(result, whitening(loop.information), config_, solver_, state_));
  static_cast<void>(review_loops(config_, solver_, state_));
}

std::vector<Pose> GraphCourt::poses() const {
  std::vector<Pose> poses;
  for (const KeyframePose& pose : state_.poses) poses.push_back(pose.T_map_body);
  return poses;
}

bool GraphCourt::holds(std::int32_t number) const {
  return std::ranges::contains(state_.loops, number, &GraphLoop::number);
}

void GraphCourt::append(GraphNode node) {
  state_.nodes.push_back(std::move(node));
  refresh_poses(solver_, state_);
  follow_nodes(state_, config_);
}

}  // namespace ignis::bench
