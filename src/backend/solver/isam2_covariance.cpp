// SPDX-License-Identifier: Apache-2.0
//
// What Isam2 knows of its variables: covariances from the cliques between them and the roots. With the information
// L L', the covariance of F'x and G'x is Y'Z, where L Y = F and L Z = G. Y is zero but for the variables on the way
// from those of F to the roots.
#include <ranges>
#include <utility>

#include "backend/solver/isam2.h"

namespace ignis {

Eigen::MatrixXd Isam2::covariance(gtsam::Key key) const {
  const int size = dimension(number_of_.at(key));
  const Term whole{key, Eigen::MatrixXd::Identity(size, size)};
  return covariance(std::span(&whole, 1));
}

Eigen::MatrixXd Isam2::covariance(std::span<const Term> terms) const {
  const Eigen::Index size = terms.front().factor.rows();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  climb(terms, [&](int, const auto& y) { covariance.noalias() += y.transpose() * y; });
  return covariance;
}

Eigen::MatrixXd Isam2::covariance(std::span<const Term> terms, std::span<const Sum> others) const {
  std::vector<Eigen::MatrixXd> y_of(cliques_.size());
  climb(terms, [&](int number, const auto& y) { y_of[static_cast<std::size_t>(number)] = y; });
  const Eigen::Index size = terms.front().factor.rows();
  Eigen::MatrixXd with_all = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(delta_.size()), size);
  descend(y_of, with_all);
  Eigen::Index columns = 0;
  for (const Sum& other : others) columns += other.front().factor.rows();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, columns);
  Eigen::Index column = 0;
  for (const Sum& other : others) {
    auto block = covariance.middleCols(column, other.front().factor.rows());
    for (const Term& term : other) {
      const int number = number_of_.at(term.key);
      block += (term.factor * rows_of(number, with_all)).transpose();
    }
    column += block.cols();
  }
  return covariance;
}

std::vector<int> Isam2::way_to_roots(std::span<const Term> terms) const {
  std::vector<std::vector<int>> ways;
  std::vector<bool> passed(cliques_.size(), false);
  for (const Term& term : terms) {
    std::vector<int>& way = ways.emplace_back();
    for (int at = variable(number_of_.at(term.key)).clique; at >= 0 && !passed[static_cast<std::size_t>(at)];
         at = clique(at).parent) {
      passed[static_cast<std::size_t>(at)] = true;
      way.push_back(at);
    }
  }
  // A later way ends below a clique of an earlier one, so it comes first.
  std::vector<int> all;
  for (const std::vector<int>& way : ways | std::views::reverse) all.insert(all.end(), way.begin(), way.end());
  return all;
}

void Isam2::climb(std::span<const Term> terms, auto visit) const {
  const Eigen::Index size = terms.front().factor.rows();
  // What is still to be solved for, by clique: rows of its variables. Only cliques that are next have any.
  std::vector<Eigen::MatrixXd> open(cliques_.size());
  std::vector<Eigen::Index> row_of(variables_.size());
  const auto open_at = [&](int number) -> Eigen::MatrixXd& {
    const Clique& at = clique(number);
    Eigen::Index rows = 0;
    for (const int held : at.variables) {
      row_of[static_cast<std::size_t>(held)] = rows;
      rows += dimension(held);
    }
    Eigen::MatrixXd& matrix = open[static_cast<std::size_t>(number)];
    if (matrix.size() == 0) matrix.setZero(rows, size);
    return matrix;
  };
  for (const Term& term : terms) {
    const int number = number_of_.at(term.key);
    if (variable(number).clique < 0) continue;  // it has no factors
    Eigen::MatrixXd& first = open_at(variable(number).clique);
    first.middleRows(row_of[static_cast<std::size_t>(number)], dimension(number)) += term.factor.transpose();
  }
  for (const int number : way_to_roots(terms)) {
    const Clique& at = clique(number);
    Eigen::MatrixXd y = std::exchange(open[static_cast<std::size_t>(number)], {});
    const Eigen::Index frontal_rows = at.conditional.cols();
    for (Eigen::Index column = 0; column < size; ++column) {
      for (Eigen::Index k = 0; k < frontal_rows; ++k) {
        const double solved = y(k, column) /= at.conditional(k, k);
        const Eigen::Index below = y.rows() - 1 - k;
        y.col(column).tail(below) -= solved * at.conditional.col(k).segment(k + 1, below);
      }
    }
    visit(number, y.topRows(frontal_rows));
    if (at.parent < 0) continue;
    Eigen::MatrixXd& next = open_at(at.parent);
    Eigen::Index row = frontal_rows;
    for (const int other : std::span(at.variables).subspan(at.frontals)) {
      next.middleRows(row_of[static_cast<std::size_t>(other)], dimension(other)) += y.middleRows(row, dimension(other));
      row += dimension(other);
    }
  }
}

void Isam2::descend(std::span<const Eigen::MatrixXd> y_of, Eigen::MatrixXd& solution) const {
  std::vector<int> open = roots_;
  while (!open.empty()) {
    const int number = open.back();
    const Clique& at = clique(number);
    open.pop_back();
    open.insert(open.end(), at.children.begin(), at.children.end());
    const Eigen::MatrixXd& y = y_of[static_cast<std::size_t>(number)];
    const Eigen::Index frontal_rows = at.conditional.cols();
    Eigen::MatrixXd solved = Eigen::MatrixXd::Zero(frontal_rows, solution.cols());
    if (y.size() > 0) solved = y;
    Eigen::Index row = frontal_rows;
    for (const int other : std::span(at.variables).subspan(at.frontals)) {
      solved.noalias() -= at.conditional.middleRows(row, dimension(other)).transpose() * rows_of(other, solution);
      row += dimension(other);
    }
    at.conditional.topRows(frontal_rows).triangularView<Eigen::Lower>().transpose().solveInPlace(solved);
    row = 0;
    for (const int frontal : std::span(at.variables).first(at.frontals)) {
      rows_of(frontal, solution) = solved.middleRows(row, dimension(frontal));
      row += dimension(frontal);
    }
  }
}

}  // namespace ignis
