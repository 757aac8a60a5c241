// SPDX-License-Identifier: Apache-2.0
#include "backend/solver/incremental_solver.h"

#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/PriorFactor.h>
#include <gtsam/nonlinear/Values.h>
#include <gtsam/slam/BetweenFactor.h>

#include <cmath>

#include "backend/factors/relative_pose_factor.h"
#include "backend/text_contains.h"

namespace ignis {
namespace {

using testing::contains;

using gtsam::Pose3;
using gtsam::symbol_shorthand::X;

const auto kNoise = gtsam::noiseModel::Isotropic::Sigma(6, 0.1);

Pose3 step() { return {gtsam::Rot3::Ry(0.1), {0.1, 0.0, -1.0}}; }

/// A chain of poses as the solver should see it, and the same one for the test to solve.
class SolverChain {
 public:
  void add(int i) {
    gtsam::NonlinearFactorGraph factors;
    gtsam::Values values;
    values.insert(X(i), i == 0 ? Pose3() : solver.estimate().at<Pose3>(X(i - 1)) * step());
    if (i == 0) {
      factors.addPrior(X(0), Pose3(), kNoise);
    } else {
      factors.emplace_shared<gtsam::BetweenFactor<Pose3>>(X(i - 1), X(i), step(), kNoise);
    }
    outcome = solver.add(factors, values);
  }
  void extend_to(int count) {
    for (int i = static_cast<int>(solver.estimate().size()); i < count; ++i) add(i);
  }
  Pose3 pose(int i) { return solver.estimate().at<Pose3>(X(i)); }

  IncrementalSolver solver{SolverConfig()};
  SolverOutcome outcome;
};

void expect_good_chain(SolverChain& chain, int count) {
  Pose3 expected;
  for (int i = 0; i < count; ++i) {
    EXPECT_TRUE(chain.pose(i).equals(expected, 1e-6)) << i;
    expected = expected * step();
  }
}

TEST(IncrementalSolver, SurvivesAnExceptionAndGoesOn) {
  SolverChain chain;
  chain.extend_to(20);
  // A pose that only its position holds: iSAM2 throws in the middle of the update and is broken afterwards.
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  WhiteningRows position_only = WhiteningRows::Zero(3, 6);
  position_only.rightCols<3>().setIdentity();
  factors.push_back(make_relative_pose_factor(X(19), X(20), Pose(), position_only));
  values.insert(X(20), chain.pose(19));
  const SolverOutcome refused = chain.solver.add(factors, values);
  EXPECT_FALSE(refused.accepted);
  EXPECT_TRUE(contains(refused.reason, "undetermined near x"));
  EXPECT_EQ(chain.solver.rebuilds(), 1);
  EXPECT_EQ(chain.solver.estimate().size(), 20U);
  chain.extend_to(40);
  EXPECT_TRUE(chain.outcome.accepted);
  expect_good_chain(chain, 40);
  EXPECT_TRUE(chain.solver.marginal_covariance(X(39)));
}

TEST(IncrementalSolver, RemovesTheRightFactorAfterARebuild) {
  SolverChain chain;
  chain.extend_to(10);
  gtsam::NonlinearFactorGraph pull;
  pull.addPrior(X(9), Pose3(gtsam::Rot3(), {5.0, 5.0, 5.0}), kNoise);
  const SolverOutcome pulled = chain.solver.add(pull, {});
  ASSERT_TRUE(pulled.accepted);
  gtsam::Values floating;
  floating.insert(X(10), Pose3());
  WhiteningRows one = WhiteningRows::Zero(1, 6);
  one(0, 0) = 1.0;
  gtsam::NonlinearFactorGraph weak;
  weak.push_back(make_relative_pose_factor(X(9), X(10), Pose(), one));
  ASSERT_FALSE(chain.solver.add(weak, floating).accepted);
  ASSERT_TRUE(chain.solver.remove(pulled.factors).accepted);
  chain.solver.settle(3);
  expect_good_chain(chain, 10);
  EXPECT_NEAR(chain.solver.half_chi_square(), 0.0, 1e-9);
  EXPECT_FALSE(chain.solver.remove(pulled.factors).accepted) << "it is gone already";
}

TEST(IncrementalSolver, RefusesBeforeTheSolverSeesIt) {
  SolverChain chain;
  chain.extend_to(3);
  const auto refusal = [&](const gtsam::NonlinearFactorGraph& factors, const gtsam::Values& values) {
    const SolverOutcome outcome = chain.solver.add(factors, values);
    EXPECT_FALSE(outcome.accepted);
    return outcome.reason;
  };
  gtsam::Values twice;
  twice.insert(X(2), Pose3());
  EXPECT_TRUE(contains(refusal({}, twice), "x2 exists"));
  gtsam::NonlinearFactorGraph unknown;
  unknown.emplace_shared<gtsam::BetweenFactor<Pose3>>(X(2), X(77), step(), kNoise);
  EXPECT_TRUE(contains(refusal(unknown, {}), "unknown variable x77"));
  gtsam::NonlinearFactorGraph not_a_number;
  not_a_number.addPrior(X(2), Pose3(gtsam::Rot3(), {std::nan(""), 0.0, 0.0}), kNoise);
  EXPECT_TRUE(contains(refusal(not_a_number, {}), "not finite"));
  EXPECT_EQ(chain.solver.rebuilds(), 0);
  chain.extend_to(6);
  expect_good_chain(chain, 6);
}

TEST(IncrementalSolver, TellsEveryNewPointOfLinearisation) {
  SolverChain chain;
  gtsam::Values told;
  const auto expect_all_told = [&](const char* when) {
    const gtsam::Values& points = chain.solver.linearisation_points();
    for (const gtsam::Key key : chain.solver.take_relinearised()) told.insert_or_assign(key, points.at(key));
    EXPECT_TRUE(told.equals(points, 0.0)) << when;
  };
  for (int i = 0; i < 20; ++i) {
    chain.add(i);
    expect_all_told("a new pose");
  }
  EXPECT_TRUE(chain.solver.take_relinearised().empty()) << "nothing has happened since";
  gtsam::NonlinearFactorGraph pull;
  pull.addPrior(X(19), Pose3(gtsam::Rot3(), {1.0, 2.0, 3.0}), kNoise);
  const SolverOutcome pulled = chain.solver.add(pull, {});
  ASSERT_TRUE(pulled.accepted);
  chain.solver.settle(5);
  expect_all_told("a correction");
  gtsam::Values shifted = chain.solver.estimate();
  shifted.update(X(7), shifted.at<Pose3>(X(7)) * Pose3(gtsam::Rot3(), {0.1, 0.0, 0.0}));
  ASSERT_TRUE(chain.solver.restart_at(shifted));
  expect_all_told("a new beginning");
  ASSERT_TRUE(chain.solver.remove(pulled.factors).accepted);
  expect_all_told("a factor less");
}

TEST(IncrementalSolver, ConstrainsOnlyTheDirectionsGiven) {
  IncrementalSolver solver{SolverConfig()};
  gtsam::NonlinearFactorGraph factors;
  gtsam::Values values;
  values.insert(X(0), Pose3());
  values.insert(X(1), step());
  factors.addPrior(X(0), Pose3(), gtsam::noiseModel::Isotropic::Sigma(6, 1e-6));
  factors.emplace_shared<gtsam::BetweenFactor<Pose3>>(X(0), X(1), step(), kNoise);
  Vector6d information = Vector6d::Constant(1e6);
  information(5) = 0.0;
  Pose T_0_1{step().rotation().toQuaternion(), step().translation()};
  factors.push_back(make_relative_pose_factor(X(0), X(1), T_0_1, whitening(information.asDiagonal())));
  ASSERT_TRUE(solver.add(factors, values).accepted);
  const auto covariance = solver.marginal_covariance(X(1));
  ASSERT_TRUE(covariance);
  EXPECT_NEAR(std::sqrt((*covariance)(5, 5)), 0.1, 1e-4);
  EXPECT_NEAR(std::sqrt((*covariance)(3, 3)), 1e-3, 1e-4);
}

/// A chain with loops, part of it fixed, beside one that holds the same part by priors as good as exact.
TEST(IncrementalSolver, WhatIsFixedStaysAndTheRestIsThatOfAnExactPrior) {
  SolverChain chain;
  SolverChain held;
  const SolverConfig at_the_solution{.relinearize_position_m = 1e-6, .relinearize_rotation_rad = 1e-6};
  chain.solver = IncrementalSolver(at_the_solution);
  held.solver = IncrementalSolver(at_the_solution);
  const auto add_loop = [](SolverChain& to, int from, int earlier, double off) {
    gtsam::NonlinearFactorGraph loop;
    Pose3 T;
    for (int i = earlier; i < from; ++i) T = T * step();
    T = T * Pose3(gtsam::Rot3(), {off, 0.0, -off});
    loop.emplace_shared<gtsam::BetweenFactor<Pose3>>(X(earlier), X(from), T, kNoise);
    EXPECT_TRUE(to.solver.add(loop, {}).accepted);
  };
  for (SolverChain* each : {&chain, &held}) {
    each->extend_to(20);
    add_loop(*each, 15, 3, 0.05);
    each->solver.settle(3);
  }
  std::vector<gtsam::Key> known;
  gtsam::NonlinearFactorGraph priors;
  for (int i = 0; i < 8; ++i) {
    known.push_back(X(i));
    priors.addPrior(X(i), held.pose(i), gtsam::noiseModel::Isotropic::Sigma(6, 1e-6));
  }
  const Pose3 before = chain.pose(7);
  ASSERT_TRUE(chain.solver.fix(known, {}, {}));
  ASSERT_TRUE(held.solver.add(priors, {}).accepted);
  EXPECT_EQ(chain.solver.estimate().size(), 12U);
  add_loop(chain, 18, 12, 0.1);
  add_loop(held, 18, 12, 0.1);
  gtsam::NonlinearFactorGraph to_known;  // a later factor names what is fixed
  to_known.emplace_shared<gtsam::BetweenFactor<Pose3>>(X(2), X(19), before.between(before), kNoise);
  ASSERT_TRUE(chain.solver.add(to_known, {}).accepted);
  ASSERT_TRUE(held.solver.add(to_known, {}).accepted);
  chain.solver.settle(10);
  held.solver.settle(10);
  EXPECT_TRUE(chain.solver.pose(X(7)).equals(before, 0.0));
  for (int i = 8; i < 20; ++i) EXPECT_LT(chain.pose(i).localCoordinates(held.pose(i)).norm(), 1e-6) << i;
  const auto covariance = chain.solver.marginal_covariance(X(19));
  const auto expected = held.solver.marginal_covariance(X(19));
  ASSERT_TRUE(covariance && expected);
  EXPECT_TRUE(covariance->isApprox(*expected, 1e-3));
  const std::vector<IncrementalSolver::KeyPair> pairs{{X(2), X(19)}};
  EXPECT_TRUE(chain.solver.relative_covariance(pairs).isApprox(held.solver.relative_covariance(pairs), 1e-3));
}

TEST(IncrementalSolver, RefusesAFactorOnWhatIsFixedAlone) {
  SolverChain chain;
  chain.extend_to(6);
  ASSERT_TRUE(chain.solver.fix(std::vector<gtsam::Key>{X(0), X(1), X(2)}, {}, {}));
  gtsam::NonlinearFactorGraph known;
  known.emplace_shared<gtsam::BetweenFactor<Pose3>>(X(0), X(2), step() * step(), kNoise);
  const SolverOutcome outcome = chain.solver.add(known, {});
  EXPECT_FALSE(outcome.accepted);
  EXPECT_TRUE(contains(outcome.reason, "names only what is fixed"));
  gtsam::Values again;
  again.insert(X(1), Pose3());
  EXPECT_TRUE(contains(chain.solver.add({}, again).reason, "x1 exists"));
}

TEST(IncrementalSolver, FixesNothingWhereTheRestCouldNotBeSolved) {
  SolverChain chain;
  chain.extend_to(6);
  gtsam::NonlinearFactorGraph instead;  // takes the place of all that speaks of pose 3, and leaves its attitude open
  WhiteningRows position_only = WhiteningRows::Zero(3, 6);
  position_only.rightCols<3>().setIdentity();
  instead.push_back(make_relative_pose_factor(X(2), X(3), Pose(), position_only));
  EXPECT_FALSE(chain.solver.fix(std::vector<gtsam::Key>{X(0), X(1), X(2), X(4), X(5)}, {}, instead));
  EXPECT_EQ(chain.solver.estimate().size(), 6U);
  EXPECT_EQ(chain.solver.failure(), "");
  chain.extend_to(10);
  expect_good_chain(chain, 10);
}

/// The past of a chain says of its end what the whole chain says before the future comes.
TEST(IncrementalSolver, ASummaryLeavesOutWhatOtherVariablesSay) {
  SolverChain past;
  past.extend_to(6);
  SolverChain chain;
  chain.extend_to(12);
  gtsam::NonlinearFactorGraph future;
  future.addPrior(X(9), chain.pose(9), gtsam::noiseModel::Isotropic::Sigma(6, 1e-3));
  ASSERT_TRUE(chain.solver.add(future, {}).accepted);
  std::vector<gtsam::Key> keys;
  for (int i = 0; i < 6; ++i) keys.push_back(X(i));
  const auto summary = chain.solver.summary_of(keys, std::vector<gtsam::Key>{X(5), X(4)});
  ASSERT_TRUE(summary);
  ASSERT_EQ(summary->covariance.rows(), 12);
  EXPECT_TRUE(
      (summary->covariance.topLeftCorner<6, 6>().isApprox(past.solver.marginal_covariance(X(5)).value(), 1e-6)));
  EXPECT_TRUE(
      (summary->covariance.bottomRightCorner<6, 6>().isApprox(past.solver.marginal_covariance(X(4)).value(), 1e-6)));
  EXPECT_FALSE(chain.solver.summary_of(std::vector<gtsam::Key>{X(4), X(5)}, std::vector<gtsam::Key>{X(5)}))
      << "without the prior nothing holds them";
  EXPECT_FALSE(chain.solver.summary_of(std::vector<gtsam::Key>{X(0), X(11)}, std::vector<gtsam::Key>{X(11)}))
      << "no factor of these names it";
}

/// A prior that a summary makes takes the place of its factors, and the solution stays although the future pulls.
TEST(IncrementalSolver, ASummaryInsteadOfTheFactorsLeavesTheSolutionWhereItIs) {
  SolverChain chain;
  chain.solver = IncrementalSolver({.relinearize_position_m = 1e-6, .relinearize_rotation_rad = 1e-6});
  chain.extend_to(12);
  gtsam::NonlinearFactorGraph future;
  future.addPrior(X(11), chain.pose(11) * Pose3(gtsam::Rot3(), {0.3, 0.2, 0.1}), kNoise);
  ASSERT_TRUE(chain.solver.add(future, {}).accepted);
  chain.solver.settle(20);
  std::vector<gtsam::Key> keys;
  for (int i = 0; i < 6; ++i) keys.push_back(X(i));
  const std::vector<gtsam::Key> wanted{X(5)};
  const auto summary = chain.solver.summary_of(keys, wanted);
  ASSERT_TRUE(summary);
  EXPECT_GT(summary->offset.norm(), 1e-3) << "else the future pulls at nothing";
  std::vector<Pose3> before;
  for (int i = 5; i < 12; ++i) before.push_back(chain.pose(i));
  gtsam::NonlinearFactorGraph instead;
  instead.addPrior(X(5), Pose3(chain.pose(5).retract(summary->offset)),
                   gtsam::noiseModel::Gaussian::Covariance(summary->covariance));
  const Eigen::MatrixXd covariance = chain.solver.marginal_covariance(X(11)).value();
  keys.pop_back();
  ASSERT_TRUE(chain.solver.fix({}, keys, instead));
  chain.solver.settle(20);
  EXPECT_EQ(chain.solver.estimate().size(), 7U);
  for (int i = 5; i < 12; ++i) {
    EXPECT_LT(before[static_cast<std::size_t>(i - 5)].localCoordinates(chain.pose(i)).norm(), 2e-4) << i;
  }
  EXPECT_TRUE(chain.solver.marginal_covariance(X(11))->isApprox(covariance, 1e-2));
}

}  // namespace
}  // namespace ignis
