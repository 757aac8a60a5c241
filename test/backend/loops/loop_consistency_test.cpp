// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_consistency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace ignis {
namespace {

/// A straight way along -Z with a metre a step and an isotropic drift.
OdometryChain straight(std::size_t count, double sigma_m) {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(sigma_m * sigma_m);
  OdometryChain chain;
  for (std::size_t i = 0; i < count; ++i) {
    Pose pose;
    pose.translation.z() = -static_cast<double>(i);
    chain.append(pose, variance.asDiagonal(), Matrix6d::Zero());
  }
  return chain;
}

LoopClaim claim(const OdometryChain& chain, std::size_t from, std::size_t to, double wrong_m, double sigma_m = 0.02) {
  LoopClaim loop{from, to, chain.T_from_to(to, from), sigma_m * sigma_m * Matrix6d::Identity(), 6};
  loop.T_to_from.translation.x() += wrong_m;
  return loop;
}

const ConsistencyRule kPlain{1.0, ChiSquareBounds(0.999)};

TEST(LoopConsistency, ComparesALoopWithTheDriftBetweenItsEnds) {
  const OdometryChain chain = straight(101, 0.05);  // 0.5 m and, by heading, 0.58 m after 100 steps
  const auto value = [&](double wrong_m, std::size_t to) {
    return test_against_odometry(claim(chain, 100, to, wrong_m), chain, kPlain);
  };
  EXPECT_NEAR(value(0.0, 0).value, 0.0, 1e-12);
  EXPECT_TRUE(value(1.0, 0).passed());
  EXPECT_FALSE(value(6.0, 0).passed());
  EXPECT_FALSE(value(1.0, 90).passed()) << "ten steps do not drift so far";
  EXPECT_NEAR(value(2.0, 0).value, 4.0 * value(1.0, 0).value, 1e-6 * value(1.0, 0).value);
  EXPECT_NEAR(value(0.0, 0).bound, 22.458, 1e-3);
  const ChiSquareTest wide = test_against_odometry(claim(chain, 100, 0, 1.0), chain, {2.0, ChiSquareBounds(0.999)});
  EXPECT_NEAR(wide.value, 0.25 * value(1.0, 0).value, 1e-9);
}

TEST(LoopConsistency, IsChiSquareDistributedForTrueLoops) {
  // Odometry as it was driven, loops as they are measured from the truth.
  std::mt19937 random(7);
  std::normal_distribution<double> unit;
  constexpr double kStep = 0.02;
  constexpr double kLoop = 0.03;
  const auto noise = [&](double sigma, double rad_per_m) {
    Vector6d v;
    for (int i = 0; i < 6; ++i) v(i) = sigma * unit(random) * (i < 3 ? rad_per_m : 1.0);
    return v;
  };
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(0.01), Eigen::Vector3d::Ones();
  const Matrix6d step = kStep * kStep * variance.asDiagonal().toDenseMatrix();
  // Loops turn enough to matter over the metres between them.
  const Matrix6d of_loop = kLoop * kLoop * Matrix6d::Identity();
  double against_odometry = 0.0;
  double against_each_other = 0.0;
  constexpr int kDrives = 400;
  for (int drive = 0; drive < kDrives; ++drive) {
    OdometryChain chain;
    std::vector<Pose> truth(1);
    Pose odometry;
    chain.append(odometry, step, Matrix6d::Zero());
    for (int i = 1; i < 40; ++i) {
      Vector6d motion;
      motion << 0.0, 0.2, 0.01, 0.1, 0.0, -1.0;
      const Pose T_previous_this = perturbed_in_body(Pose(), motion);
      truth.push_back(truth.back() * T_previous_this);
      odometry = odometry * perturbed_in_body(T_previous_this, noise(kStep, 0.1));
      chain.append(odometry, step, Matrix6d::Zero());
    }
    const auto measured = [&](std::size_t from, std::size_t to) {
      return LoopClaim{from, to, perturbed_in_body(truth[to].inverse() * truth[from], noise(kLoop, 1.0)), of_loop, 6};
    };
    const LoopClaim a = measured(33, 2);
    const LoopClaim b = measured(38, 9);
    against_odometry += test_against_odometry(a, chain, kPlain).value / kDrives;
    against_each_other += test_against_each_other(a, b, chain, kPlain).value / kDrives;
    EXPECT_NEAR(test_against_each_other(b, a, chain, kPlain).value, test_against_each_other(a, b, chain, kPlain).value,
                0.15 * test_against_each_other(a, b, chain, kPlain).value + 0.1);
  }
  // Six degrees of freedom; the mean of 400 has a sigma of 0.17.
  EXPECT_NEAR(against_odometry, 6.0, 0.6);
  EXPECT_NEAR(against_each_other, 6.0, 0.6);
}

TEST(LoopConsistency, JudgesNeighboursMoreStrictlyThanOdometryCan) {
  const OdometryChain chain = straight(101, 0.05);
  const LoopClaim wrong = claim(chain, 100, 0, 1.0);
  const LoopClaim right = claim(chain, 98, 1, 0.0);
  EXPECT_TRUE(test_against_odometry(wrong, chain, kPlain).passed());
  EXPECT_FALSE(test_against_each_other(wrong, right, chain, kPlain).passed());
  EXPECT_TRUE(test_against_each_other(claim(chain, 100, 0, 0.05), right, chain, kPlain).passed());
  EXPECT_GT(open_distance(100, 0, chain, kPlain), 0.5);
  EXPECT_LT(open_distance(wrong, right, chain, kPlain), 0.2);
  EXPECT_NEAR(open_distance(100, 0, chain, {2.0, ChiSquareBounds(0.999)}), 2.0 * open_distance(100, 0, chain, kPlain),
              1e-9);
}

TEST(LoopConsistency, BelievesTheLargestSetWhoeverCameFirst) {
  const std::vector<std::vector<bool>> agree = {
      {false, false, false, true}, {false, false, true, true}, {false, true, false, true}, {true, true, true, false}};
  const std::vector<double> cost = {0.0, 5.0, 5.0, 5.0};
  EXPECT_EQ(largest_agreeing_set(agree, cost), (std::vector<std::size_t>{1, 2, 3}));
}

TEST(LoopConsistency, BelievesTheCheaperOfEqualSets) {
  const std::vector<std::vector<bool>> agree = {{false, false}, {false, false}};
  EXPECT_EQ(largest_agreeing_set(agree, std::vector<double>{2.0, 1.0}), (std::vector<std::size_t>{1}));
  EXPECT_EQ(largest_agreeing_set(agree, std::vector<double>{1.0, 2.0}), (std::vector<std::size_t>{0}));
  EXPECT_TRUE(largest_agreeing_set({}, {}).empty());
}

TEST(LoopConsistency, FindsTheTrueBlockAmongStrayAgreements) {
  // As many as a full search of all subsets finds.
  std::mt19937 random(9);
  std::bernoulli_distribution stray(0.3);
  for (int round = 0; round < 60; ++round) {
    constexpr std::size_t kCount = 12;
    std::vector<std::vector<bool>> agree(kCount, std::vector<bool>(kCount, false));
    for (std::size_t i = 0; i < kCount; ++i) {
      for (std::size_t k = 0; k < i; ++k) agree[i][k] = agree[k][i] = (i < 6 && k < 6) || stray(random);
    }
    std::size_t most = 0;
    for (unsigned subset = 1; subset < (1U << kCount); ++subset) {
      bool together = true;
      std::size_t size = 0;
      for (std::size_t i = 0; i < kCount && together; ++i) {
        if ((subset >> i & 1U) == 0U) continue;
        ++size;
        for (std::size_t k = 0; k < i; ++k) together = together && ((subset >> k & 1U) == 0U || agree[i][k]);
      }
      if (together) most = std::max(most, size);
    }
    const std::vector<std::size_t> found = largest_agreeing_set(agree, std::vector<double>(kCount, 1.0));
    EXPECT_EQ(found.size(), most);
    for (const std::size_t i : found) {
      for (const std::size_t k : found) {
        EXPECT_TRUE(i == k || agree[i][k]);
      }
    }
  }
}

}  // namespace
}  // namespace ignis
