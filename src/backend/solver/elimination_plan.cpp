// SPDX-License-Identifier: Apache-2.0
#include "backend/solver/elimination_plan.h"

#include <gtsam/inference/Ordering.h>
#include <gtsam/inference/VariableIndex.h>

#include <algorithm>
#include <numeric>
#include <utility>

namespace ignis {
namespace {

// [multiplications] What a clique costs besides its arithmetic.
constexpr double kCostOfClique = 500.0;

/// Which rows hold a variable, as GTSAM's interface to CCOLAMD asks for it.
class RowsOfVariables : public gtsam::VariableIndex {
 public:
  explicit RowsOfVariables(std::span<const std::vector<int>> rows) {
    for (std::size_t row = 0; row < rows.size(); ++row) {
      for (const int variable : rows[row]) index_[static_cast<gtsam::Key>(variable)].push_back(row);
      nEntries_ += rows[row].size();
    }
    nFactors_ = rows.size();
  }
};

/// Variables in the order in which they go.
std::vector<int> elimination_order(std::span<const std::vector<int>> rows, const std::vector<bool>& last) {
  gtsam::FastMap<gtsam::Key, int> groups;
  for (std::size_t variable = 0; variable < last.size(); ++variable) {
    if (last[variable]) groups[variable] = 1;
  }
  if (groups.size() == last.size()) groups.clear();
  const RowsOfVariables held(rows);
  const gtsam::VariableIndex& index = held;
  const gtsam::Ordering ordering = gtsam::Ordering::ColamdConstrained(index, groups);
  return {ordering.begin(), ordering.end()};
}

/// A clique in the making; variables are places in the order.
struct Draft {
  std::vector<int> frontals;
  std::vector<int> others;  ///< ascending
  int frontal_rows = 0;
  int other_rows = 0;
  bool joined = false;  ///< with its parent
};

double cost(int frontal_rows, int other_rows) {
  const double f = frontal_rows;
  const double s = other_rows + 1.0;
  return f * f * f / 6.0 + f * f * s / 2.0 + f * s * s / 2.0;
}

class Planner {
 public:
  Planner(std::span<const std::vector<int>> rows, std::span<const int> dimensions, const std::vector<bool>& last)
      : rows_(rows),
        dimensions_(dimensions),
        order_(elimination_order(rows, last)),
        place_(dimensions.size()),
        home_(dimensions.size()),
        children_(dimensions.size()),
        drafts_(dimensions.size()),
        seen_by_(dimensions.size(), -1) {
    for (std::size_t i = 0; i < order_.size(); ++i) place_[static_cast<std::size_t>(order_[i])] = static_cast<int>(i);
    for (std::size_t row = 0; row < rows.size(); ++row) {
      const int first = place_of(std::ranges::min(rows[row], {}, [this](int v) { return place_of(v); }));
      home_[static_cast<std::size_t>(first)].push_back(row);
    }
  }

  std::vector<PlannedClique> plan() {
    for (int place = 0; place < static_cast<int>(order_.size()); ++place) draft(place);
    return cliques();
  }

 private:
  [[nodiscard]] int place_of(int variable) const { return place_[static_cast<std::size_t>(variable)]; }
  [[nodiscard]] int dimension_at(int place) const {
    return dimensions_[static_cast<std::size_t>(order_[static_cast<std::size_t>(place)])];
  }

  /// The variable at `place` as a clique of its own, and then those of its children that are better joined with it.
  void draft(int place) {
    const auto at = static_cast<std::size_t>(place);
    Draft& draft = drafts_[at];
    draft.frontals = {place};
    draft.frontal_rows = dimension_at(place);
    seen_by_[at] = place;
    const auto see = [&](int other) {
      if (std::exchange(seen_by_[static_cast<std::size_t>(other)], place) != place) draft.others.push_back(other);
    };
    for (const std::size_t row : home_[at]) {
      for (const int variable : rows_[row]) see(place_of(variable));
    }
    for (const int child : children_[at]) {
      for (const int other : drafts_[static_cast<std::size_t>(child)].others) see(other);
    }
    std::ranges::sort(draft.others);
    for (const int other : draft.others) draft.other_rows += dimension_at(other);
    if (!draft.others.empty()) children_[static_cast<std::size_t>(draft.others.front())].push_back(place);
    for (const int child : children_[at]) join_if_cheaper(drafts_[static_cast<std::size_t>(child)], draft);
  }

  static void join_if_cheaper(Draft& child, Draft& parent) {
    const int together = child.frontal_rows + parent.frontal_rows;
    if (cost(together, parent.other_rows) > cost(child.frontal_rows, child.other_rows) +
                                                cost(parent.frontal_rows, parent.other_rows) +
                                                0.5 * child.other_rows * child.other_rows + kCostOfClique) {
      return;
    }
    child.joined = true;
    parent.frontals.insert(parent.frontals.end(), child.frontals.begin(), child.frontals.end());
    parent.frontal_rows = together;
  }

  std::vector<PlannedClique> cliques() {
    std::vector<PlannedClique> planned;
    std::vector<std::ptrdiff_t> clique_of(order_.size());
    for (Draft& draft : drafts_) {
      if (draft.joined) continue;
      std::ranges::sort(draft.frontals);
      PlannedClique clique;
      clique.frontals = draft.frontals.size();
      for (const int place : draft.frontals) {
        const auto at = static_cast<std::size_t>(place);
        clique_of[at] = static_cast<std::ptrdiff_t>(planned.size());
        clique.variables.push_back(order_[at]);
        clique.rows.insert(clique.rows.end(), home_[at].begin(), home_[at].end());
      }
      for (const int place : draft.others) clique.variables.push_back(order_[static_cast<std::size_t>(place)]);
      planned.push_back(std::move(clique));
    }
    for (PlannedClique& clique : planned) {
      if (clique.frontals == clique.variables.size()) continue;
      const int first = place_of(clique.variables[clique.frontals]);
      clique.parent = clique_of[static_cast<std::size_t>(first)];
    }
    return planned;
  }

  std::span<const std::vector<int>> rows_;
  std::span<const int> dimensions_;
  std::vector<int> order_;                      ///< variables, the first to go first
  std::vector<int> place_;                      ///< by variable, in order_
  std::vector<std::vector<std::size_t>> home_;  ///< by place: rows whose first variable to go stands there
  std::vector<std::vector<int>> children_;      ///< by place: those whose others begin there
  std::vector<Draft> drafts_;                   ///< by place
  std::vector<int> seen_by_;                    ///< by place: the last draft that has seen it
};

}  // namespace

std::vector<PlannedClique> plan_elimination(std::span<const std::vector<int>> rows, std::span<const int> dimensions,
                                            const std::vector<bool>& last) {
  return Planner(rows, dimensions, last).plan();
}

}  // namespace ignis
