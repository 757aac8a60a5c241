// SPDX-License-Identifier: Apache-2.0
#include "backend/solver/isam2.h"

#include <gtest/gtest.h>
#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/nonlinear/ISAM2.h>
#include <gtsam/nonlinear/Marginals.h>
#include <gtsam/slam/BetweenFactor.h>

#include <algorithm>
#include <array>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "backend/solver/elimination_plan.h"

namespace ignis {
namespace {

using gtsam::Pose3;
using gtsam::symbol_shorthand::X;

const auto kNoise = gtsam::noiseModel::Isotropic::Sigma(6, 0.1);

constexpr double kRelinearizeAbove = 0.02;

gtsam::ISAM2Params parameters(int relinearize_skip) {
  gtsam::ISAM2Params params;
  gtsam::FastMap<char, gtsam::Vector> thresholds;
  thresholds['x'] = gtsam::Vector6::Constant(kRelinearizeAbove);
  params.relinearizeThreshold = thresholds;
  params.relinearizeSkip = relinearize_skip;
  params.optimizationParams = gtsam::ISAM2GaussNewtonParams(0.0);
  params.findUnusedFactorSlots = false;
  return params;
}

Isam2Settings settings(int relinearize_skip, double wildfire_threshold) {
  return {{{'x', gtsam::Vector6::Constant(kRelinearizeAbove)}}, relinearize_skip, wildfire_threshold};
}

gtsam::Values estimate(const Isam2& isam) {
  gtsam::Values values;
  for (const gtsam::Key key : isam.linearisation_points().keys()) {
    values.insert(key, isam.linearisation_points().at<Pose3>(key).retract(isam.offset(key)));
  }
  return values;
}

/// The same random history for GTSAM's own iSAM2 and for ours: a noisy chain, loops that bend it, one of which goes.
class Twins {
 public:
  Twins(unsigned seed, int relinearize_skip)
      : theirs(parameters(relinearize_skip)), ours(settings(relinearize_skip, 0.0)), random_(seed) {}

  void append(int i) {
    gtsam::NonlinearFactorGraph factors;
    gtsam::Values values;
    if (i == 0) {
      factors.addPrior(X(0), Pose3(), kNoise);
    } else {
      factors.emplace_shared<gtsam::BetweenFactor<Pose3>>(X(i - 1), X(i), noisy(kStep), kNoise);
    }
    values.insert(X(i), i == 0 ? Pose3() : theirs.calculateEstimate<Pose3>(X(i - 1)) * noisy(kStep));
    update(factors, values, {});
  }

  std::size_t close(int from, int to) {
    gtsam::NonlinearFactorGraph factors;
    factors.emplace_shared<gtsam::BetweenFactor<Pose3>>(X(to), X(from), noisy(Pose3()), kNoise);
    return update(factors, {}, {}).new_factors.front();
  }

  Isam2::Step update(const gtsam::NonlinearFactorGraph& factors, const gtsam::Values& values,
                     const std::vector<std::size_t>& removed) {
    const gtsam::Values before = estimate(ours);
    const auto expected =
        theirs.update(factors, values, gtsam::FactorIndices(removed.begin(), removed.end())).newFactorsIndices;
    Isam2::Step step = ours.advance(factors, values, removed);
    EXPECT_TRUE(std::ranges::equal(step.new_factors, expected));
    expect_same(before, step);
    return step;
  }

  gtsam::ISAM2 theirs;
  Isam2 ours;
  int relinearised = 0;

 private:
  static inline const Pose3 kStep{gtsam::Rot3::Ry(0.3), {0.2, 0.0, -1.0}};

  Pose3 noisy(const Pose3& pose) {
    std::normal_distribution<double> normal(0.0, 0.05);
    return pose.retract(gtsam::Vector6::NullaryExpr([&] { return normal(random_); }));
  }

  void expect_same(const gtsam::Values& before, const Isam2::Step& step) {
    relinearised += step.relinearised.empty() ? 0 : 1;
    const gtsam::Values now = estimate(ours);
    EXPECT_TRUE(now.equals(theirs.calculateEstimate(), 1e-12));
    EXPECT_TRUE(ours.linearisation_points().equals(theirs.getLinearizationPoint(), 1e-12));
    for (const gtsam::Key key : now.keys()) {
      const bool stands = before.exists(key) && before.at<Pose3>(key).matrix() == now.at<Pose3>(key).matrix();
      EXPECT_TRUE(stands || std::ranges::contains(step.moved, key)) << gtsam::Symbol(key).index();
    }
  }

  std::mt19937 random_;
};

class Isam2History : public ::testing::TestWithParam<int> {};

TEST_P(Isam2History, StandsWhereGtsamsOwnStandsAndNamesWhatMoved) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Twins twins(seed, GetParam());
    std::size_t loop = 0;
    for (int i = 0; i < 70; ++i) {
      twins.append(i);
      if (i > 25 && i % 7 == 0) {
        loop = twins.close(i, i - 21);
        twins.update({}, {}, {});
        twins.update({}, {}, {});
      }
      if (i == 50) twins.update({}, {}, {loop});
    }
    EXPECT_GT(twins.relinearised, 5);
  }
}

INSTANTIATE_TEST_SUITE_P(RelinearizeSkips, Isam2History, ::testing::Values(1, 3));

TEST(Isam2, KnowsTheCovarianceOfEachVariable) {
  Twins twins(1, 1);
  for (int i = 0; i < 40; ++i) twins.append(i);
  twins.close(39, 18);
  const gtsam::Marginals batch(twins.theirs.getFactorsUnsafe(), twins.ours.linearisation_points());
  for (int i = 0; i < 40; ++i) {
    EXPECT_TRUE(twins.ours.covariance(X(i)).isApprox(batch.marginalCovariance(X(i)), 1e-9)) << i;
  }
}

TEST(Isam2, KnowsTheCovarianceOfASumOfVariables) {
  Twins twins(1, 1);
  for (int i = 0; i < 40; ++i) twins.append(i);
  twins.close(39, 18);
  const gtsam::Marginals batch(twins.theirs.getFactorsUnsafe(), twins.ours.linearisation_points());
  gtsam::Matrix6 turn = gtsam::Matrix6::Zero();
  turn.topRightCorner<3, 3>().setIdentity();
  turn.bottomLeftCorner<3, 3>() = -2.0 * gtsam::I_3x3;
  // Neighbours, ends of a loop, one above the other in the tree and far apart; both ways round.
  for (const auto& [a, b] : {std::pair(3, 4), {39, 18}, {18, 39}, {0, 39}, {25, 5}}) {
    const std::array<Isam2::Term, 2> terms{Isam2::Term{X(a), turn}, Isam2::Term{X(b), gtsam::I_6x6}};
    const gtsam::JointMarginal joint = batch.jointMarginalCovariance({X(a), X(b)});
    const gtsam::Matrix6 cross = turn * joint(X(a), X(b));
    const gtsam::Matrix6 expected =
        turn * joint(X(a), X(a)) * turn.transpose() + joint(X(b), X(b)) + cross + cross.transpose();
    EXPECT_TRUE(twins.ours.covariance(terms).isApprox(expected, 1e-8)) << a << ' ' << b;
  }
}

TEST(Isam2, KnowsTheCovarianceBetweenSumsOfVariables) {
  Twins twins(1, 1);
  for (int i = 0; i < 40; ++i) twins.append(i);
  twins.close(39, 18);
  const gtsam::Marginals batch(twins.theirs.getFactorsUnsafe(), twins.ours.linearisation_points());
  const auto difference = [](int a, int b) { return Isam2::Sum{{X(a), -gtsam::I_6x6}, {X(b), gtsam::I_6x6}}; };
  const auto expected = [&](const std::pair<int, int>& first, const std::pair<int, int>& second) {
    const auto& [a, b] = first;
    const auto& [c, d] = second;
    std::set<gtsam::Key> keys{X(a), X(b), X(c), X(d)};
    const gtsam::JointMarginal joint = batch.jointMarginalCovariance(gtsam::KeyVector(keys.begin(), keys.end()));
    return gtsam::Matrix6(joint(X(b), X(d)) - joint(X(b), X(c)) - joint(X(a), X(d)) + joint(X(a), X(c)));
  };
  const std::vector<std::pair<int, int>> pairs{{3, 4}, {20, 30}, {18, 39}, {0, 39}, {5, 25}, {30, 10}};
  for (const auto& one : pairs) {
    std::vector<Isam2::Sum> others;
    for (const auto& [a, b] : pairs) others.push_back(difference(a, b));
    const Eigen::MatrixXd with_others = twins.ours.covariance(difference(one.first, one.second), others);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const gtsam::Matrix6 known = expected(one, pairs[i]);
      const auto found = with_others.middleCols<6>(6 * static_cast<Eigen::Index>(i));
      EXPECT_LT((found - known).norm(), 1e-8 * known.norm() + 1e-14) << one.first << " and " << pairs[i].first;

      // Both as one sum of twelve rows; 39 is in two terms of it.
      Isam2::Sum both;
      for (const auto& [first_row, pair] : {std::pair(0, one), std::pair(6, pairs[i])}) {
        for (Isam2::Term& term : difference(pair.first, pair.second)) {
          Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(12, 6);
          factor.middleRows<6>(first_row) = term.factor;
          both.push_back({term.key, factor});
        }
      }
      const Eigen::MatrixXd joint = twins.ours.covariance(both);
      EXPECT_LT((joint.topRightCorner<6, 6>() - known).norm(), 1e-8 * known.norm() + 1e-14) << one.first;
      EXPECT_TRUE((joint.topLeftCorner<6, 6>().isApprox(expected(one, one), 1e-8))) << one.first;
    }
  }
}

TEST(Isam2, KeepsOfACliqueOnlyWhatIsAskedForAgain) {
  Twins twins(1, 1);
  for (int i = 0; i < 40; ++i) twins.append(i);
  const Isam2::Size size = twins.ours.size();
  EXPECT_GT(size.cliques, 3U);
  // In a chain one pose of six scalars stands between two cliques. The root passes nothing on.
  const std::size_t rest_of_six = 6 * 7 / 2 + 6;
  EXPECT_EQ(size.rests, (size.cliques - 1) * rest_of_six);
}

TEST(Isam2, HasTheSameBitsEachTime) {
  const auto history = [] {
    Twins twins(3, 1);
    for (int i = 0; i < 60; ++i) {
      twins.append(i);
      if (i > 25 && i % 7 == 0) twins.close(i, i - 21);
    }
    return estimate(twins.ours);
  };
  const gtsam::Values once = history();
  const gtsam::Values again = history();
  for (const gtsam::Key key : once.keys()) {
    EXPECT_EQ(once.at<Pose3>(key).matrix(), again.at<Pose3>(key).matrix()) << gtsam::Symbol(key).index();
  }
}

TEST(Isam2, RefusesAChainThatMayBeAnywhere) {
  // No prior: where the information of the last number was, elimination leaves rounding, of either sign.
  for (int count = 2; count < 60; ++count) {
    Isam2 isam(settings(1, 0.0));
    gtsam::NonlinearFactorGraph factors;
    gtsam::Values values;
    for (int i = 0; i < count; ++i) {
      values.insert(X(i), gtsam::Vector1(0.3 * i));
      if (i == 0) continue;
      const auto noise = gtsam::noiseModel::Isotropic::Sigma(1, 0.1 + 0.001 * i);
      factors.emplace_shared<gtsam::BetweenFactor<gtsam::Vector1>>(X(i - 1), X(i), gtsam::Vector1(1.0), noise);
    }
    EXPECT_THROW(isam.advance(factors, values, {}), gtsam::IndeterminantLinearSystemException) << count;
  }
}

TEST(Isam2, KeepsTwoIslandsApart) {
  Isam2 isam(settings(1, 0.0));
  const auto add = [&](int i, int from, const Pose3& place) {
    gtsam::NonlinearFactorGraph factors;
    gtsam::Values values;
    values.insert(X(i), Pose3());
    if (from < 0) {
      factors.addPrior(X(i), place, kNoise);
    } else {
      factors.emplace_shared<gtsam::BetweenFactor<Pose3>>(X(from), X(i), place, kNoise);
    }
    isam.advance(factors, values, {});
  };
  const Pose3 here(gtsam::Rot3(), {0.0, 0.0, 1.0});
  const Pose3 there(gtsam::Rot3(), {100.0, 0.0, 0.0});
  add(0, -1, here);
  add(1, -1, there);
  for (int i = 2; i < 20; ++i) add(i, i - 2, Pose3(gtsam::Rot3(), {1.0, 0.0, 0.0}));
  const gtsam::Values now = estimate(isam);
  for (int i = 0; i < 20; ++i) {
    const Pose3& start = i % 2 == 0 ? here : there;
    const int steps = i / 2;
    EXPECT_NEAR(now.at<Pose3>(X(i)).x(), start.x() + steps, 1e-9) << i;
    EXPECT_NEAR(now.at<Pose3>(X(i)).z(), start.z(), 1e-9) << i;
  }
}

TEST(EliminationPlan, LetsTheMarkedGoLastAndChildrenBeforeParents) {
  constexpr int kVariables = 40;
  std::vector<std::vector<int>> rows;
  for (int i = 1; i < kVariables; ++i) rows.push_back({i - 1, i});
  rows.push_back({0, kVariables - 1});
  const std::vector<int> dimensions(kVariables, 6);
  std::vector<bool> last(kVariables, false);
  last[7] = last[23] = true;
  const std::vector<PlannedClique> plan = plan_elimination(rows, dimensions, last);
  std::vector<int> gone;
  std::size_t homes = 0;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    gone.insert(gone.end(), plan[i].variables.begin(),
                plan[i].variables.begin() + static_cast<std::ptrdiff_t>(plan[i].frontals));
    homes += plan[i].rows.size();
    if (i + 1 < plan.size()) {
      EXPECT_GT(plan[i].parent, static_cast<std::ptrdiff_t>(i));
    }
  }
  EXPECT_EQ(homes, rows.size());
  ASSERT_EQ(gone.size(), static_cast<std::size_t>(kVariables));
  EXPECT_TRUE(std::ranges::is_permutation(std::span(gone).last(2), std::vector<int>{7, 23}));
}

/// A straight chain.
class Chain {
 public:
  explicit Chain(double wildfire_threshold) : isam(settings(1, wildfire_threshold)) {}

  std::size_t append(int i) {
    gtsam::NonlinearFactorGraph factors;
    gtsam::Values values;
    if (i == 0) {
      factors.addPrior(X(0), Pose3(), kNoise);
    } else {
      factors.emplace_shared<gtsam::BetweenFactor<Pose3>>(X(i - 1), X(i), link_, kNoise);
    }
    values.insert(X(i), Pose3(gtsam::Rot3(), {static_cast<double>(i), 0.0, 0.0}));
    all_.push_back(factors);
    return isam.advance(factors, values, {}).moved.size();
  }

  /// Says once more where the newest pose is, a little elsewhere each time.
  void pull(int i, double by) {
    gtsam::NonlinearFactorGraph factors;
    factors.addPrior(X(i), estimate(isam).at<Pose3>(X(i)) * Pose3(gtsam::Rot3(), {by, 0.0, 0.0}), kNoise);
    all_.push_back(factors);
    isam.advance(factors, {}, {});
  }

  /// The solution of the same linear system, whole.
  [[nodiscard]] gtsam::Values exact_estimate() const {
    return isam.linearisation_points().retract(all_.linearize(isam.linearisation_points())->optimize());
  }

  Isam2 isam;

 private:
  gtsam::NonlinearFactorGraph all_;
  Pose3 link_{gtsam::Rot3(), {1.0, 0.0, 0.0}};
};

TEST(Isam2, MovesOnlyWhatAKeyframeReaches) {
  Chain chain(1e-3);
  std::size_t moved = 0;
  for (int i = 0; i < 50; ++i) moved = chain.append(i);
  EXPECT_LT(moved, 5U);
}

TEST(Isam2, PassesSmallChangesOnWhenTheyAddUp) {
  constexpr double kThreshold = 1e-4;
  Chain chain(kThreshold);
  for (int i = 0; i < 10; ++i) chain.append(i);
  const double before = estimate(chain.isam).at<Pose3>(X(1)).x();
  for (int i = 0; i < 100; ++i) chain.pull(9, 10.0 * kThreshold);
  const gtsam::Values now = estimate(chain.isam);
  const gtsam::Values exact = chain.exact_estimate();
  EXPECT_GT(exact.at<Pose3>(X(1)).x() - before, 5.0 * kThreshold);
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(now.at<Pose3>(X(i)).x(), exact.at<Pose3>(X(i)).x(), 10.0 * kThreshold) << i;
  }
}

}  // namespace
}  // namespace ignis
