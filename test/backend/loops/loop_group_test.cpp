// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_group.h"

#include <gtest/gtest.h>
#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/PriorFactor.h>
#include <gtsam/nonlinear/Values.h>

#include <algorithm>
#include <vector>

#include "backend/factors/gtsam_conversion.h"
#include "backend/factors/relative_pose_factor.h"
#include "backend/keyframes/revision_report.h"
#include "backend/loops/loop_admission.h"
#include "backend/loops/loop_trial.h"

namespace ignis {
namespace {

using gtsam::symbol_shorthand::X;

WhiteningRows rows(double sigma_rad, double sigma_m) {
  Vector6d scale;
  scale << Eigen::Vector3d::Constant(1.0 / sigma_rad), Eigen::Vector3d::Constant(1.0 / sigma_m);
  return scale.asDiagonal().toDenseMatrix();
}

/// 40 poses, a metre apart on a circle, tied by vague odometry, and loops that enter without being asked.
struct Circle {
  Circle() {
    config.loop_drift_scale = 1.0;
    config.loop_support_beyond_m = 1.0;
    for (int i = 0; i < 40; ++i) append(i);
    follow_nodes(state, config);
  }

  static Pose truth(int i) {
    const double angle = 0.15 * i;
    return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
            {7.0 * std::cos(angle), 7.0 * std::sin(angle), 0.0}};
  }

  void append(int i) {
    GraphNode node;
    node.end.id = i;
    node.end.filter.T_odom_body = truth(i);
    node.odometry = rows(0.005, 0.15);
    gtsam::NonlinearFactorGraph factors;
    gtsam::Values values;
    if (i == 0) {
      factors.addPrior(X(0), to_gtsam(truth(0)), gtsam::noiseModel::Isotropic::Sigma(6, 1e-3));
    } else {
      const auto from = static_cast<unsigned>(i - 1);
      factors.push_back(
          make_relative_pose_factor(X(from), X(from + 1), truth(i - 1).inverse() * truth(i), node.odometry));
    }
    values.insert(X(static_cast<unsigned>(i)), to_gtsam(truth(i)));
    ASSERT_TRUE(solver.add(factors, values).accepted);
    state.nodes.push_back(node);
    refresh_poses(solver, state);
  }

  /// The world that it sees is `shift` beside the true one.
  void enter(int from, int to, const Eigen::Vector3d& shift, double sigma_m) {
    GraphLoop loop;
    loop.number = state.next_loop_number++;
    loop.result.from_id = from;
    loop.result.to_id = to;
    Pose shifted = truth(from);
    shifted.translation += shift;
    loop.result.T_to_from = truth(to).inverse() * shifted;
    loop.rows = rows(0.01, sigma_m);
    ASSERT_TRUE(enter_graph(loop, config, solver, state).entered);
  }
  void enter_group(const Eigen::Vector3d& shift) {
    for (int i = 0; i < 3; ++i) enter(20 + 2 * i, 5 + 2 * i, shift, 0.05);
  }
  void enter_others() {
    for (int i = 0; i < 4; ++i) enter(38 - i, 2 + i, Eigen::Vector3d::Zero(), 0.1);
    for (int i = 0; i < 4; ++i) enter(35 - i, 19 + i, Eigen::Vector3d::Zero(), 0.1);
  }

  BackendConfig config;
  IncrementalSolver solver{SolverConfig()};
  SmootherState state;
};

TEST(LoopGroup, HoldsTheLoopsBesideThatSayTheSame) {
  Circle circle;
  circle.enter_group({3.0, 0.0, 0.0});
  circle.enter(22, 6, Eigen::Vector3d::Zero(), 0.05);  // beside them, and says something else
  circle.enter_others();
  std::vector<std::size_t> group = group_of(1, rule_of(circle.config), circle.state);
  std::ranges::sort(group);
  EXPECT_EQ(group, (std::vector<std::size_t>{0, 1, 2}));
}

TEST(LoopGroup, IsSeenFromOutsideAsByAGraphThatNeverHadIt) {
  Circle circle;
  circle.enter_group({0.3, 0.2, 0.0});
  circle.enter_others();
  Circle without;
  without.enter_others();
  const ConsistencyRule rule = rule_of(circle.config);
  const std::vector<OutsideView> views = seen_from_outside({0, 1, 2}, rule, circle.solver, circle.state);
  ASSERT_EQ(views.size(), 3U);
  for (const OutsideView& view : views) {
    GraphLoop loop = circle.state.loops[view.index];
    loop.number = 100;  // one that the other graph does not hold
    const GraphOpinion expected = opinion_on(loop, rule, without.solver, without.state);
    EXPECT_NEAR(view.opinion.test.value, expected.test.value, 0.05 * expected.test.value);
    EXPECT_NEAR(view.opinion.open_m, expected.open_m, 0.05 * expected.open_m);
  }
}

TEST(LoopGroup, IsTakenOutAfterItsTrialWhenOnlyItSpeaksForItself) {
  Circle circle;
  circle.config.loop_trial_keyframes = 0;
  circle.enter_group({2.0, 0.0, 0.0});
  circle.enter_others();
  LoopEvents events;
  for (int i = 40; i < 60; ++i) {
    circle.append(i);
    follow_nodes(circle.state, circle.config);
    for (GraphLoop& event : review_loops(circle.config, circle.solver, circle.state)) events.push_back(event);
  }
  EXPECT_TRUE(std::ranges::any_of(events, [](const GraphLoop& event) {
    return event.result.reason_text.starts_with("withdrawn: only its own group speaks for it");
  }));
  for (const GraphLoop& loop : circle.state.loops) EXPECT_GE(loop.number, 3);
  EXPECT_EQ(circle.state.loops.size(), 8U);
  EXPECT_EQ(circle.state.waiting.size(), 3U);
}

}  // namespace
}  // namespace ignis
