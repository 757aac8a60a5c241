// SPDX-License-Identifier: Apache-2.0
#include "backend/observed_isam2.h"

#include <gtest/gtest.h>
#include <gtsam/geometry/Pose3.h>
#include <gtsam/inference/Symbol.h>
#include <gtsam/linear/HessianFactor.h>
#include <gtsam/slam/BetweenFactor.h>

#include <algorithm>
#include <random>

namespace ignis {
namespace {

using gtsam::Pose3;
using gtsam::symbol_shorthand::X;

const auto kNoise = gtsam::noiseModel::Isotropic::Sigma(6, 0.1);

gtsam::ISAM2Params parameters(int relinearize_skip, double wildfire_threshold) {
  gtsam::ISAM2Params params;
  gtsam::FastMap<char, gtsam::Vector> thresholds;
  thresholds['x'] = gtsam::Vector6::Constant(0.02);
  params.relinearizeThreshold = thresholds;
  params.relinearizeSkip = relinearize_skip;
  params.optimizationParams = gtsam::ISAM2GaussNewtonParams(wildfire_threshold);
  params.findUnusedFactorSlots = false;
  return params;
}

/// The same random history for GTSAM's own iSAM2 and for ours: a noisy chain, loops that bend it, one of which goes.
class Twins {
 public:
  Twins(unsigned seed, int relinearize_skip)
      : theirs(parameters(relinearize_skip, 0.0)), ours(parameters(relinearize_skip, 0.0)), random_(seed) {}

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

  ObservedIsam2::Step update(const gtsam::NonlinearFactorGraph& factors, const gtsam::Values& values,
                             const gtsam::FactorIndices& removed) {
    const gtsam::Values before = ours.empty() ? gtsam::Values() : ours.calculateEstimate();
    const auto expected = theirs.update(factors, values, removed).newFactorsIndices;
    ObservedIsam2::Step step = ours.advance(factors, values, removed);
    EXPECT_EQ(step.new_factors, expected);
    expect_same(before, step);
    return step;
  }

  gtsam::ISAM2 theirs;
  ObservedIsam2 ours;
  int relinearised = 0;

 private:
  static inline const Pose3 kStep{gtsam::Rot3::Ry(0.3), {0.2, 0.0, -1.0}};

  Pose3 noisy(const Pose3& pose) {
    std::normal_distribution<double> normal(0.0, 0.05);
    return pose.retract(gtsam::Vector6::NullaryExpr([&] { return normal(random_); }));
  }

  void expect_same(const gtsam::Values& before, const ObservedIsam2::Step& step) {
    relinearised += step.relinearised ? 1 : 0;
    const gtsam::Values now = ours.calculateEstimate();
    EXPECT_TRUE(now.equals(theirs.calculateEstimate(), 1e-12));
    EXPECT_TRUE(ours.getLinearizationPoint().equals(theirs.getLinearizationPoint(), 1e-12));
    for (const gtsam::Key key : now.keys()) {
      const bool stands = before.exists(key) && before.at<Pose3>(key).matrix() == now.at<Pose3>(key).matrix();
      EXPECT_TRUE(stands || std::ranges::contains(step.moved, key)) << gtsam::Symbol(key).index();
    }
  }

  std::mt19937 random_;
};

class ObservedIsam2History : public ::testing::TestWithParam<int> {};

TEST_P(ObservedIsam2History, StandsWhereGtsamsOwnStandsAndNamesWhatMoved) {
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

INSTANTIATE_TEST_SUITE_P(RelinearizeSkips, ObservedIsam2History, ::testing::Values(1, 3));

TEST(ObservedIsam2, KeepsOfItsCachedMatricesOnlyWhatIsAskedForAgain) {
  Twins twins(1, 1);
  for (int i = 0; i < 40; ++i) twins.append(i);
  twins.close(39, 3);
  std::vector<gtsam::ISAM2Clique::shared_ptr> open(twins.ours.roots().begin(), twins.ours.roots().end());
  int hessians = 0;
  while (!open.empty()) {
    const auto clique = open.back();
    open.pop_back();
    open.insert(open.end(), clique->children.begin(), clique->children.end());
    const auto hessian = boost::dynamic_pointer_cast<gtsam::HessianFactor>(clique->cachedFactor());
    if (!hessian) continue;
    ++hessians;
    EXPECT_EQ(hessian->info().blockStart(), 0) << "rows of eliminated variables are left";
    EXPECT_EQ(hessian->keys().size(), clique->conditional()->nrParents());
  }
  EXPECT_GT(hessians, 10);
}

/// A straight chain.
class Chain {
 public:
  explicit Chain(double wildfire_threshold) : isam(parameters(1, wildfire_threshold)) {}

  std::size_t append(int i) {
    gtsam::NonlinearFactorGraph factors;
    gtsam::Values values;
    if (i == 0) {
      factors.addPrior(X(0), Pose3(), kNoise);
    } else {
      factors.emplace_shared<gtsam::BetweenFactor<Pose3>>(X(i - 1), X(i), link_, kNoise);
    }
    values.insert(X(i), Pose3(gtsam::Rot3(), {static_cast<double>(i), 0.0, 0.0}));
    return isam.advance(factors, values, {}).moved.size();
  }

  /// Says once more where the newest pose is, a little elsewhere each time.
  void pull(int i, double by) {
    gtsam::NonlinearFactorGraph factors;
    factors.addPrior(X(i), isam.calculateEstimate<Pose3>(X(i)) * Pose3(gtsam::Rot3(), {by, 0.0, 0.0}), kNoise);
    isam.advance(factors, {}, {});
  }

  ObservedIsam2 isam;

 private:
  Pose3 link_{gtsam::Rot3(), {1.0, 0.0, 0.0}};
};

TEST(ObservedIsam2, MovesOnlyWhatAKeyframeReaches) {
  Chain chain(1e-3);
  std::size_t moved = 0;
  for (int i = 0; i < 50; ++i) moved = chain.append(i);
  EXPECT_LT(moved, 5U);
}

TEST(ObservedIsam2, PassesSmallChangesOnWhenTheyAddUp) {
  constexpr double kThreshold = 1e-4;
  Chain chain(kThreshold);
  for (int i = 0; i < 10; ++i) chain.append(i);
  const double before = chain.isam.calculateEstimate<Pose3>(X(1)).x();
  for (int i = 0; i < 100; ++i) chain.pull(9, 10.0 * kThreshold);
  const gtsam::Values now = chain.isam.calculateEstimate();
  const gtsam::Values exact = chain.isam.calculateBestEstimate();
  EXPECT_GT(exact.at<Pose3>(X(1)).x() - before, 5.0 * kThreshold);
  for (int i = 0; i < 10; ++i) {
    EXPECT_NEAR(now.at<Pose3>(X(i)).x(), exact.at<Pose3>(X(i)).x(), 10.0 * kThreshold) << i;
  }
}

}  // namespace
}  // namespace ignis
