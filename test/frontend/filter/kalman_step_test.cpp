// SPDX-License-Identifier: Apache-2.0
#include "frontend/filter/kalman_step.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <random>

namespace ignis {
namespace {

template <int kRows>
struct Measured {
  Eigen::Matrix<double, kRows, 1> residual;
  Eigen::Matrix<double, kRows, kErrorSize> derivative;
  Eigen::Matrix<double, kRows, 1> variance;
};

template <int kRows>
Measured<kRows> some_numbers(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Measured<kRows> made;
  const auto draw = [&] { return normal(random); };
  made.residual = decltype(made.residual)::NullaryExpr(draw) * 0.1;
  made.derivative = decltype(made.derivative)::NullaryExpr(draw);
  made.variance = decltype(made.variance)::NullaryExpr(draw).cwiseAbs2() * 0.01;
  return made;
}

FilterState some_filter() {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  const ErrorCovariance root = ErrorCovariance::NullaryExpr([&] { return 0.1 * normal(random); });
  FilterState filter;
  filter.covariance = root * root.transpose() + 1e-4 * ErrorCovariance::Identity();
  return filter;
}

TEST(KalmanStep, IsTheInformationForm) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Measured<6> measured = some_numbers<6>(seed);
    const FilterState before = some_filter();
    FilterState after = before;
    kalman_step(after, measured.residual, measured.derivative, measured.variance);
    const Vector6d weight = measured.variance.cwiseInverse();
    const ErrorCovariance prior = before.covariance.ldlt().solve(ErrorCovariance::Identity());
    const ErrorCovariance information =
        prior + measured.derivative.transpose() * weight.asDiagonal() * measured.derivative;
    const ErrorVector pull = measured.derivative.transpose() * weight.asDiagonal() * measured.residual;
    const ErrorVector step = -information.ldlt().solve(pull);
    const ErrorCovariance covariance = information.ldlt().solve(ErrorCovariance::Identity());
    EXPECT_LT((after.covariance - covariance).norm(), 1e-9 * covariance.norm());
    EXPECT_LT((difference(before.nominal, after.nominal) - step).norm(), 1e-9);
  }
}

TEST(KalmanStep, WhatIsConsideredLearnsNothingAndTheRestAllTheSame) {
  const Measured<6> measured = some_numbers<6>(4);
  FilterState full = some_filter();
  FilterState considered = full;
  ErrorVector learns = ErrorVector::Ones();
  learns.segment<3>(kPosition).setZero();
  kalman_step(full, measured.residual, measured.derivative, measured.variance);
  kalman_step(considered, measured.residual, measured.derivative, measured.variance, learns);
  const FilterState before = some_filter();
  const auto part = [](const ErrorCovariance& of, ErrorBlock block) { return of.block<3, 3>(block, block).eval(); };
  EXPECT_LT((part(considered.covariance, kPosition) - part(before.covariance, kPosition)).norm(), 1e-12);
  EXPECT_LT((part(considered.covariance, kVelocity) - part(full.covariance, kVelocity)).norm(), 1e-9);
  EXPECT_EQ(considered.nominal.T_odom_body.translation, before.nominal.T_odom_body.translation);
  EXPECT_LT((considered.nominal.v_odom - full.nominal.v_odom).norm(), 1e-9);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<ErrorCovariance>(considered.covariance).eigenvalues().minCoeff(), 0.0);
}

TEST(KalmanStep, OfAllNumbersAtOnceIsThatOfOneAfterTheOther) {
  const Measured<6> measured = some_numbers<6>(3);
  FilterState at_once = some_filter();
  FilterState one_by_one = at_once;
  kalman_step(at_once, measured.residual, measured.derivative, measured.variance);
  for (int i = 0; i < 6; ++i) {
    const Eigen::Matrix<double, 1, kErrorSize> row = measured.derivative.row(i);
    const ErrorVector moved = difference(some_filter().nominal, one_by_one.nominal);
    kalman_step<1>(one_by_one, Eigen::Matrix<double, 1, 1>(measured.residual(i) + row.dot(moved)), row,
                   measured.variance.segment<1>(i));
  }
  EXPECT_LT((at_once.covariance - one_by_one.covariance).norm(), 1e-9 * at_once.covariance.norm());
  // Attitudes do not add, to second order.
  EXPECT_LT(difference(at_once.nominal, one_by_one.nominal).norm(), 0.02);
}

}  // namespace
}  // namespace ignis
