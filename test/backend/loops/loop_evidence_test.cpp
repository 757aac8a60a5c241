// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/loop_evidence.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>
#include <vector>

namespace ignis {
namespace {

constexpr Eigen::Index kStates = 20;

/// A linear graph with a prior, and measurements of sums of its states, as an oracle that solves everything anew.
struct LinearGraph {
  struct Loop {
    Eigen::MatrixXd sum;    ///< 6 by states: what it is about
    WhiteningRows rows;     ///< some observe fewer than six directions
    Eigen::VectorXd claim;  ///< 6
    bool is_in = false;
  };

  explicit LinearGraph(unsigned seed) : random(seed) {
    const Eigen::MatrixXd root = some(kStates, kStates);
    prior = root * root.transpose() + Eigen::MatrixXd::Identity(kStates, kStates);
    for (int i = 0; i < 6; ++i) {
      loops.push_back({some(6, kStates), some(i % 3 == 0 ? 4 : 6, 6), some(6, 1), i % 2 == 0});
    }
  }

  [[nodiscard]] Eigen::MatrixXd some(Eigen::Index rows, Eigen::Index columns) {
    std::normal_distribution<double> unit;
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return unit(random); });
  }

  struct Solution {
    Eigen::MatrixXd covariance;
    Eigen::VectorXd state;
    double chi_square = 0.0;
  };
  [[nodiscard]] Solution solved() const {
    Eigen::MatrixXd information = prior;
    Eigen::VectorXd vector = Eigen::VectorXd::Zero(kStates);
    for (const Loop& loop : loops) {
      if (!loop.is_in) continue;
      const Eigen::MatrixXd whitened = loop.rows * loop.sum;
      information += whitened.transpose() * whitened;
      vector += whitened.transpose() * (loop.rows * loop.claim);
    }
    Solution solution;
    solution.covariance = information.inverse();
    solution.state = solution.covariance * vector;
    solution.chi_square = solution.state.dot(prior * solution.state);
    for (const Loop& loop : loops) {
      if (loop.is_in) solution.chi_square += (loop.rows * (loop.sum * solution.state - loop.claim)).squaredNorm();
    }
    return solution;
  }

  [[nodiscard]] LoopEvidence evidence() const {
    const Solution solution = solved();
    const auto count = static_cast<Eigen::Index>(loops.size());
    Eigen::MatrixXd sums(6 * count, kStates);
    Eigen::VectorXd error(6 * count);
    std::vector<LoopEvidence::Part> parts;
    Eigen::Index row = 0;
    for (const Loop& loop : loops) {
      sums.middleRows<6>(row) = loop.sum;
      error.segment<6>(row) = loop.sum * solution.state - loop.claim;
      parts.push_back({loop.rows, loop.is_in});
      row += 6;
    }
    return {std::move(parts), sums * solution.covariance * sums.transpose(), std::move(error)};
  }

  std::mt19937 random;
  Eigen::MatrixXd prior;
  std::vector<Loop> loops;
};

TEST(LoopEvidence, CostsWhatTheGraphsChiSquareChangesBy) {
  LinearGraph graph(1);
  const LoopEvidence evidence = graph.evidence();
  const double before = graph.solved().chi_square;
  for (std::size_t i = 0; i < graph.loops.size(); ++i) {
    LinearGraph other = graph;
    other.loops[i].is_in = !other.loops[i].is_in;
    EXPECT_NEAR(evidence.cost(i), std::abs(other.solved().chi_square - before), 1e-4) << i;
  }
}

TEST(LoopEvidence, AfterMovesIsThatOfTheGraphSolvedAnew) {
  LinearGraph graph(2);
  LoopEvidence moved = graph.evidence();
  for (const std::size_t i : {0U, 1U, 3U, 2U, 1U, 5U}) {
    graph.loops[i].is_in = !graph.loops[i].is_in;
    moved.move(i);
    const LoopEvidence anew = graph.evidence();
    for (std::size_t k = 0; k < graph.loops.size(); ++k) {
      EXPECT_EQ(moved.is_in(k), graph.loops[k].is_in);
      EXPECT_NEAR(moved.cost(k), anew.cost(k), 1e-3 * (1.0 + anew.cost(k))) << k;
      EXPECT_TRUE(moved.covariance(k).isApprox(anew.covariance(k), 1e-3)) << k;
    }
  }
}

}  // namespace
}  // namespace ignis
