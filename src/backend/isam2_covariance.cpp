// SPDX-License-Identifier: Apache-2.0
//
// What Isam2 knows of its variables: covariances from the cliques between them and the roots.
#include <algorithm>
#include <ranges>

#include "backend/isam2.h"

namespace ignis {

Eigen::MatrixXd Isam2::covariance(gtsam::Key key) const {
  const int size = dimension(number_of_.at(key));
  const Term whole{key, Eigen::MatrixXd::Identity(size, size)};
  return covariance(std::span(&whole, 1));
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

Eigen::MatrixXd Isam2::covariance(std::span<const Term> terms) const {
  const Root all = root(terms);
  return covariance(all, all);
}

Isam2::Root Isam2::root(std::span<const Term> terms) const {
  // With the information L L', the covariance of F' x is Y'Y, where L Y = F. Y is zero but for the variables on the way
  // from those of F to the roots.
  const Eigen::Index size = terms.front().factor.rows();
  std::vector<double> open_rows(delta_.size() * static_cast<std::size_t>(size), 0.0);
  const auto open = [&](int number) {
    return Eigen::Map<Eigen::MatrixXd>(&open_rows[variable(number).offset * static_cast<std::size_t>(size)],
                                       dimension(number), size);
  };
  for (const Term& term : terms) open(number_of_.at(term.key)) = term.factor.transpose();
  Root root{size, {}};
  for (const int number : way_to_roots(terms)) {
    const Clique& at = clique(number);
    const std::span<const int> variables = at.variables;
    const Eigen::Index frontal_rows = at.conditional.cols();
    Eigen::MatrixXd y(frontal_rows, size);
    Eigen::Index row = 0;
    for (const int frontal : variables.first(at.frontals)) {
      y.middleRows(row, dimension(frontal)) = open(frontal);
      row += dimension(frontal);
    }
    at.conditional.topRows(frontal_rows).triangularView<Eigen::Lower>().solveInPlace(y);
    for (const int other : variables.subspan(at.frontals)) {
      open(other).noalias() -= at.conditional.middleRows(row, dimension(other)) * y;
      row += dimension(other);
    }
    root.parts.push_back({number, std::move(y)});
  }
  std::ranges::sort(root.parts, {}, &Root::Part::clique);
  return root;
}

Eigen::MatrixXd Isam2::covariance(const Root& a, const Root& b) {
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(a.size, b.size);
  auto other = b.parts.begin();
  for (const Root::Part& part : a.parts) {
    other = std::ranges::lower_bound(other, b.parts.end(), part.clique, {}, &Root::Part::clique);
    if (other == b.parts.end()) break;
    if (other->clique == part.clique) covariance.noalias() += part.rows.transpose() * other->rows;
  }
  return covariance;
}

}  // namespace ignis
