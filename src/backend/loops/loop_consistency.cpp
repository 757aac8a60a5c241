// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_consistency.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/dynamic_bitset.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <numeric>

namespace ignis {
namespace {

ChiSquareTest test(const Vector6d& error, const Matrix6d& covariance, int directions, const ConsistencyRule& rule) {
  const Matrix6d scaled = rule.sigma_scale * rule.sigma_scale * covariance;
  return {error.dot(scaled.ldlt().solve(error)), rule.bounds.of(directions)};
}

/// Covariance of loop `a` minus the way round through loop `b`, in body axes of a.from.
Matrix6d cycle_covariance(const LoopClaim& a, const LoopClaim& b, const OdometryChain& odometry) {
  const Pose T_afrom_bfrom = odometry.T_from_to(a.from, b.from);
  const Matrix6d from_b_start = adjoint(T_afrom_bfrom * b.T_to_from.inverse());
  const Matrix6d from_b_end = adjoint(T_afrom_bfrom);
  return a.covariance + odometry.covariance(b.from, a.from) + from_b_end * b.covariance * from_b_end.transpose() +
         from_b_start * odometry.covariance(a.to, b.to) * from_b_start.transpose();
}

}  // namespace

ChiSquareBounds::ChiSquareBounds(double probability) {
  for (std::size_t i = 1; i < bounds_.size(); ++i) {
    bounds_[i] = boost::math::quantile(boost::math::chi_squared(static_cast<double>(i)), probability);
  }
}

ChiSquareTest test_against_odometry(const LoopClaim& loop, const OdometryChain& odometry, const ConsistencyRule& rule) {
  const Vector6d error = body_difference(loop.T_to_from, odometry.T_from_to(loop.to, loop.from));
  return test(error, loop.covariance + odometry.covariance(loop.to, loop.from), loop.directions, rule);
}

ChiSquareTest test_against_each_other(const LoopClaim& a, const LoopClaim& b, const OdometryChain& odometry,
                                      const ConsistencyRule& rule) {
  const Pose around = odometry.T_from_to(a.to, b.to) * b.T_to_from * odometry.T_from_to(b.from, a.from);
  return test(body_difference(a.T_to_from, around), cycle_covariance(a, b, odometry),
              std::min(a.directions, b.directions), rule);
}

double largest_position_sigma(const Matrix6d& covariance, const ConsistencyRule& rule) {
  const Eigen::Matrix3d position = covariance.bottomRightCorner<3, 3>();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(position, Eigen::EigenvaluesOnly);
  return rule.sigma_scale * std::sqrt(std::max(0.0, eigen.eigenvalues()(2)));
}

double open_distance(std::size_t from, std::size_t to, const OdometryChain& odometry, const ConsistencyRule& rule) {
  return largest_position_sigma(odometry.covariance(to, from), rule);
}

double open_distance(const LoopClaim& a, const LoopClaim& b, const OdometryChain& odometry,
                     const ConsistencyRule& rule) {
  return largest_position_sigma(cycle_covariance(a, b, odometry), rule);
}

std::vector<std::size_t> largest_agreeing_set(const std::vector<std::vector<bool>>& agree,
                                              std::span<const double> cost) {
  const std::size_t count = agree.size();
  std::vector<std::ptrdiff_t> degree(count);
  for (std::size_t i = 0; i < count; ++i) degree[i] = std::ranges::count(agree[i], true);
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    return degree[a] != degree[b] ? degree[a] > degree[b] : cost[a] < cost[b];
  });
  // By place in that order, so that who may still join is a row of bits and the next one its lowest.
  std::vector<boost::dynamic_bitset<>> agreeing(count, boost::dynamic_bitset<>(count));
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < count; ++k) agreeing[i][k] = i != k && agree[order[i]][order[k]];
  }
  std::vector<std::size_t> best;
  double best_cost = 0.0;
  for (std::size_t start = 0; start < count; ++start) {
    std::vector<std::size_t> set = {order[start]};
    double set_cost = cost[order[start]];
    boost::dynamic_bitset<> with_all = agreeing[start];
    for (std::size_t i = with_all.find_first(); i < count; i = with_all.find_next(i)) {
      set.push_back(order[i]);
      set_cost += cost[order[i]];
      with_all &= agreeing[i];
    }
    if (set.size() < best.size() || (set.size() == best.size() && set_cost >= best_cost)) continue;
    best = std::move(set);
    best_cost = set_cost;
    if (best.size() == count) break;
  }
  std::ranges::sort(best);
  return best;
}

}  // namespace ignis
