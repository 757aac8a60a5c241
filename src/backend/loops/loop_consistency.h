// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "backend/keyframes/odometry_chain.h"

/// Whether loops can be true together. Odometry is the witness: two loops and the odometry between their ends form a
/// cycle, which must close. Judged by pairs, and of all loops the largest set in which everybody agrees with everybody
/// is believed (J. Mangelson, D. Dominic, R. Eustice, R. Vasudevan, "Pairwise consistent measurement set maximization
/// for robust multi-robot map merging", ICRA 2018). Loops that entered the graph have no say in this, so a wrong one
/// that came first cannot keep true ones out.
namespace ignis {

/// What a loop claims.
struct LoopClaim {
  std::size_t from = 0;  ///< place in the chain of the keyframe that looked
  std::size_t to = 0;    ///< place of the earlier one
  Pose T_to_from;
  Matrix6d covariance = Matrix6d::Identity();  ///< body axes of `from`; huge where the loop says nothing
  int directions = 6;                          ///< in which it says something
};

/// The largest chi-square that is believed of an error, by its degrees of freedom: quantiles, looked up once.
class ChiSquareBounds {
 public:
  explicit ChiSquareBounds(double probability);
  [[nodiscard]] double of(Eigen::Index directions) const { return bounds_.at(static_cast<std::size_t>(directions)); }

 private:
  std::array<double, 7> bounds_{};  ///< of none to six
};

struct ConsistencyRule {
  double sigma_scale = 1.0;  ///< factor on all sigmas: errors of odometry are correlated
  ChiSquareBounds bounds{0.999};
};

struct ChiSquareTest {
  double value = 0.0;
  double bound = 0.0;
  [[nodiscard]] bool passed() const { return value <= bound; }  ///< false for what is not a number
};

/// The loop against the odometry between its ends.
[[nodiscard]] ChiSquareTest test_against_odometry(const LoopClaim& loop, const OdometryChain& odometry,
                                                  const ConsistencyRule& rule);

/// The cycle through both loops.
[[nodiscard]] ChiSquareTest test_against_each_other(const LoopClaim& a, const LoopClaim& b,
                                                    const OdometryChain& odometry, const ConsistencyRule& rule);

/// [m] Largest sigma of the position in the covariance of a relative pose, scaled by the rule.
[[nodiscard]] double largest_position_sigma(const Matrix6d& covariance, const ConsistencyRule& rule);

/// [m] Largest sigma of the place of `from` relative to `to` that odometry leaves open, scaled by the rule.
[[nodiscard]] double open_distance(std::size_t from, std::size_t to, const OdometryChain& odometry,
                                   const ConsistencyRule& rule);

/// [m] The same for the cycle through both loops: how far apart the two could be and still agree.
[[nodiscard]] double open_distance(const LoopClaim& a, const LoopClaim& b, const OdometryChain& odometry,
                                   const ConsistencyRule& rule);

/// Ascending indices of a largest set whose members all agree; of several such sets the one with the least sum of
/// `cost`. `agree` is symmetric. Exact cliques are out of reach for many loops: this is the greedy heuristic from every
/// start (B. Pattabiraman et al., "Fast algorithms for the maximum clique problem on massive graphs", 2013), which is
/// exact where the agreeing loops form one block. Deterministic.
[[nodiscard]] std::vector<std::size_t> largest_agreeing_set(const std::vector<std::vector<bool>>& agree,
                                                            std::span<const double> cost);

}  // namespace ignis
