// SPDX-License-Identifier: Apache-2.0
#include "backend/solver/isam2.h"

#include <gtsam/inference/Symbol.h>
#include <gtsam/linear/GaussianFactor.h>
#include <gtsam/linear/linearExceptions.h>

#include <algorithm>
#include <cstdint>

#include "backend/solver/elimination_plan.h"

namespace ignis {
namespace {

// Where an update eliminates so much of the graph, it eliminates all of it, in an order that is good for all.
constexpr double kNearlyAll = 0.65;

void keep_each_once(auto& numbers) {
  std::ranges::sort(numbers);
  const auto rest = std::ranges::unique(numbers);
  numbers.erase(rest.begin(), rest.end());
}

}  // namespace

Isam2::Step Isam2::advance(const gtsam::NonlinearFactorGraph& factors, const gtsam::Values& values,
                           std::span<const std::size_t> removed) {
  Step step;
  ++updates_;
  std::vector<int> above;
  if (updates_ % settings_.relinearize_skip == 0) {
    above = above_threshold();
    unchecked_.clear();
  }
  for (const int number : above) step.relinearised.push_back(variable(number).key);
  std::vector<int> news;  // variables of new and removed factors
  for (const std::size_t index : removed) {
    const std::vector<int>& held = factors_.at(index).linear.variables;
    news.insert(news.end(), held.begin(), held.end());
    remove_factor(index);
  }
  std::vector<int> marked = relinearise(above);
  add_variables(values);
  for (const auto& factor : factors) {
    step.new_factors.push_back(factors_.size());
    add_factor(factor);
    const std::vector<int>& held = factors_.back().linear.variables;
    news.insert(news.end(), held.begin(), held.end());
  }
  marked.insert(marked.end(), news.begin(), news.end());
  eliminate(take_top(marked), news);
  const std::vector<int> moved = back_substitute();
  for (const int number : moved) step.moved.push_back(variable(number).key);
  unchecked_.insert(unchecked_.end(), moved.begin(), moved.end());
  return step;
}

gtsam::Vector Isam2::offset(gtsam::Key key) const { return delta(number_of_.at(key)); }

const std::vector<std::size_t>& Isam2::factors_of(gtsam::Key key) const { return variable(number_of_.at(key)).factors; }

std::vector<int> Isam2::above_threshold() const {
  std::vector<int> above;
  for (const int number : unchecked_) {
    const auto letter = static_cast<char>(gtsam::Symbol(variable(number).key).chr());
    if ((delta(number).array().abs() > settings_.thresholds.at(letter).array()).any()) above.push_back(number);
  }
  keep_each_once(above);
  return above;
}

void Isam2::add_variables(const gtsam::Values& values) {
  theta_.insert(values);
  for (const auto& added : values) {
    const auto dimension = added.value.dim();
    number_of_.emplace(added.key, static_cast<int>(variables_.size()));
    Variable& made = variables_.emplace_back();
    made.key = added.key;
    made.offset = delta_.size();
    dimensions_.push_back(static_cast<int>(dimension));
    delta_.resize(delta_.size() + dimension, 0.0);
  }
}

void Isam2::add_factor(const gtsam::NonlinearFactor::shared_ptr& factor) {
  for (const gtsam::Key key : factor->keys()) variable(number_of_.at(key)).factors.push_back(factors_.size());
  factors_.push_back({factor, linearised(*factor), 0});
}

void Isam2::remove_factor(std::size_t index) {
  Factor& factor = factors_[index];
  for (const int number : factor.linear.variables) std::erase(variable(number).factors, index);
  factor = {};
}

QuadraticForm Isam2::linearised(const gtsam::NonlinearFactor& factor) const {
  QuadraticForm form;
  Eigen::Index rows = 1;
  for (const gtsam::Key key : factor.keys()) {
    form.variables.push_back(number_of_.at(key));
    rows += dimension(form.variables.back());
  }
  gtsam::Matrix information = gtsam::Matrix::Zero(rows, rows);
  if (const auto linear = factor.linearize(theta_)) information = linear->augmentedInformation();
  form.lower.reserve(static_cast<std::size_t>(rows * (rows + 1) / 2 - 1));
  for (Eigen::Index column = 0; column < rows - 1; ++column) {
    const double* const begin = &information(column, column);
    form.lower.insert(form.lower.end(), begin, begin + (rows - column));
  }
  return form;
}

std::vector<int> Isam2::relinearise(std::span<const int> numbers) {
  std::vector<std::size_t> touched;
  for (const int number : numbers) {
    const Variable& moved = variable(number);
    gtsam::Value* value = theta_.at(moved.key).retract_(delta(number));
    theta_.update(moved.key, *value);
    value->deallocate_();
    touched.insert(touched.end(), moved.factors.begin(), moved.factors.end());
  }
  keep_each_once(touched);
  std::vector<int> tied;
  for (const std::size_t index : touched) {
    Factor& factor = factors_[index];
    factor.linear = linearised(*factor.nonlinear);
    tied.insert(tied.end(), factor.linear.variables.begin(), factor.linear.variables.end());
  }
  return tied;
}

Isam2::Top Isam2::take_top(std::span<const int> marked) {
  Top top;
  for (const int number : marked) {
    Variable& fresh = variable(number);
    if (fresh.clique >= 0 || fresh.factors.empty() || std::exchange(fresh.in_top, updates_) == updates_) continue;
    top.variables.push_back(number);
  }
  const std::vector<int> taken = take_cliques(marked, top.variables.size());
  for (const int number : taken) {
    const Clique& gone = clique(number);
    for (const int frontal : std::span(gone.variables).first(gone.frontals)) {
      variable(frontal).clique = -1;
      if (variable(frontal).factors.empty()) continue;  // it has lost the last one, and with it its place
      variable(frontal).in_top = updates_;
      top.variables.push_back(frontal);
    }
    std::ranges::copy_if(gone.children, std::back_inserter(top.orphans),
                         [this](int child) { return !clique(child).taken; });
  }
  std::erase_if(roots_, [this](int root) { return clique(root).taken; });
  for (const int number : taken) {
    clique(number) = {};
    free_cliques_.push_back(number);
  }
  std::ranges::sort(top.variables);
  std::ranges::sort(top.orphans);
  gather_sum(top);
  return top;
}

std::vector<int> Isam2::take_cliques(std::span<const int> marked, std::size_t fresh) {
  std::vector<int> taken;
  std::size_t count = fresh;
  const auto take = [&](int number) {
    clique(number).taken = true;
    count += clique(number).frontals;
    taken.push_back(number);
  };
  for (const int number : marked) {
    for (int at = variable(number).clique; at >= 0 && !clique(at).taken; at = clique(at).parent) take(at);
  }
  if (static_cast<double>(count) < kNearlyAll * static_cast<double>(variables_.size())) return taken;
  for (const int root : roots_) {
    if (!clique(root).taken) take(root);
  }
  for (std::size_t i = 0; i < taken.size(); ++i) {
    for (const int child : clique(taken[i]).children) {
      if (!clique(child).taken) take(child);
    }
  }
  return taken;
}

void Isam2::gather_sum(Top& top) {
  for (const int number : top.variables) {
    for (const std::size_t index : variable(number).factors) {
      Factor& factor = factors_[index];
      if (std::exchange(factor.looked_at, updates_) == updates_) continue;
      // One that reaches below is part of what an orphan passes on.
      const auto is_in_top = [this](int held) { return variable(held).in_top == updates_; };
      if (std::ranges::all_of(factor.linear.variables, is_in_top)) top.sum.push_back(&factor.linear);
    }
  }
  for (const int orphan : top.orphans) top.sum.push_back(&clique(orphan).rest);
}

void Isam2::eliminate(const Top& top, std::span<const int> last) {
  // Within the top, variables have numbers of their own.
  std::vector<int> place(variables_.size());
  std::vector<int> dimensions;
  for (const int number : top.variables) {
    place[static_cast<std::size_t>(number)] = static_cast<int>(dimensions.size());
    dimensions.push_back(dimension(number));
  }
  std::vector<bool> goes_last(top.variables.size(), false);
  for (const int number : last) {
    if (variable(number).in_top == updates_) {
      goes_last[static_cast<std::size_t>(place[static_cast<std::size_t>(number)])] = true;
    }
  }
  std::vector<std::vector<int>> rows;
  for (const QuadraticForm* form : top.sum) {
    std::vector<int>& row = rows.emplace_back();
    for (const int held : form->variables) row.push_back(place[static_cast<std::size_t>(held)]);
  }
  const std::vector<PlannedClique> plan = plan_elimination(rows, dimensions, goes_last);

  std::vector<int> numbers(plan.size());
  std::ranges::generate(numbers, [this] { return new_clique(); });
  const std::size_t factors = top.sum.size() - top.orphans.size();
  std::vector<const QuadraticForm*> forms;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    Clique& made = clique(numbers[i]);
    made.frontals = plan[i].frontals;
    for (const int at : plan[i].variables) made.variables.push_back(top.variables[static_cast<std::size_t>(at)]);
    forms.clear();
    for (const int child : made.children) forms.push_back(&clique(child).rest);
    for (const std::size_t row : plan[i].rows) {
      forms.push_back(top.sum[row]);
      if (row < factors) continue;
      made.children.push_back(top.orphans[row - factors]);
      clique(made.children.back()).parent = numbers[i];
    }
    fill_clique(numbers[i], forms);
    if (plan[i].parent < 0) {
      roots_.push_back(numbers[i]);
    } else {
      made.parent = numbers[static_cast<std::size_t>(plan[i].parent)];
      clique(made.parent).children.push_back(numbers[i]);
    }
  }
}

int Isam2::new_clique() {
  if (free_cliques_.empty()) {
    cliques_.emplace_back();
    return static_cast<int>(cliques_.size()) - 1;
  }
  const int number = free_cliques_.back();
  free_cliques_.pop_back();
  return number;
}

void Isam2::fill_clique(int number, std::span<const QuadraticForm* const> forms) {
  Clique& made = clique(number);
  const std::span<const int> frontals = std::span(made.variables).first(made.frontals);
  front_.begin(made.variables, made.frontals, dimensions_);
  for (const QuadraticForm* form : forms) front_.add(*form);
  find_scale(frontals);
  if (Eigen::Index failed = front_.eliminate(scale_); failed >= 0) {
    auto at = frontals.begin();
    for (; failed >= dimension(*at); ++at) failed -= dimension(*at);
    throw gtsam::IndeterminantLinearSystemException(variable(*at).key);
  }
  made.conditional = front_.conditional();
  made.rest = front_.rest();
  made.is_new = true;
  for (const int frontal : frontals) variable(frontal).clique = number;
}

void Isam2::find_scale(std::span<const int> numbers) {
  scale_.clear();
  for (const int number : numbers) {
    const std::size_t begin = scale_.size();
    scale_.resize(begin + static_cast<std::size_t>(dimension(number)), 0.0);
    for (const std::size_t index : variable(number).factors)
      factors_[index].linear.add_diagonal(number, dimensions_, std::span(scale_).subspan(begin));
  }
}

std::vector<int> Isam2::back_substitute() {
  std::vector<int> moved;
  // From the roots down to where nothing changes by more than the threshold.
  std::vector<int> open = roots_;
  while (!open.empty()) {
    Clique& at = clique(open.back());
    open.pop_back();
    const std::span<const int> variables = at.variables;
    const bool depends = at.is_new || std::ranges::any_of(variables.subspan(at.frontals), [this](int number) {
                           return variable(number).moved == updates_;
                         });
    if (!depends) continue;
    open.insert(open.end(), at.children.begin(), at.children.end());
    // What was linearised or eliminated anew counts as changed in any case.
    if (!solve(at, std::exchange(at.is_new, false) ? 0.0 : settings_.wildfire_threshold)) continue;
    for (const int number : variables.first(at.frontals)) {
      variable(number).moved = updates_;
      moved.push_back(number);
    }
  }
  return moved;
}

bool Isam2::solve(const Clique& at, double threshold) {
  const std::span<const int> variables = at.variables;
  const Eigen::Index frontal_rows = at.conditional.cols();
  const Eigen::Index rows = at.conditional.rows() - 1;
  solution_.resize(rows);
  Eigen::Index row = frontal_rows;
  for (const int number : variables.subspan(at.frontals)) {
    solution_.segment(row, dimension(number)) = delta(number);
    row += dimension(number);
  }
  // A column of the factor, below its diagonal, meets what is known already: later scalars of the clique and others.
  for (Eigen::Index k = frontal_rows - 1; k >= 0; --k) {
    const Eigen::Index known = rows - 1 - k;
    const double sum = at.conditional.col(k).segment(k + 1, known).dot(solution_.tail(known));
    solution_(k) = (at.conditional(rows, k) - sum) / at.conditional(k, k);
  }
  if (!solution_.head(frontal_rows).allFinite()) {
    throw gtsam::IndeterminantLinearSystemException(variable(variables.front()).key);
  }
  double change = 0.0;
  row = 0;
  for (const int number : variables.first(at.frontals)) {
    change = std::max(change, (solution_.segment(row, dimension(number)) - delta(number)).lpNorm<Eigen::Infinity>());
    row += dimension(number);
  }
  if (change < threshold) return false;
  row = 0;
  for (const int number : variables.first(at.frontals)) {
    Eigen::Map<gtsam::Vector>(&delta_[variable(number).offset], dimension(number)) =
        solution_.segment(row, dimension(number));
    row += dimension(number);
  }
  return true;
}

Isam2::Size Isam2::size() const {
  Size size;
  for (const Clique& clique : cliques_) {
    if (clique.frontals == 0) continue;
    ++size.cliques;
    size.rests += clique.rest.lower.size();
    size.conditionals += static_cast<std::size_t>(clique.conditional.size());
  }
  return size;
}

}  // namespace ignis
