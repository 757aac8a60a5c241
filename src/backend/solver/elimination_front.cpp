// SPDX-License-Identifier: Apache-2.0
#include "backend/solver/elimination_front.h"

#include <algorithm>
#include <cmath>

namespace ignis {
namespace {

constexpr Eigen::Index kBlock = 32;  // columns between two updates of what follows them
constexpr double kRounding = 1e-14;  // share of a scalar's information that is none

}  // namespace

void QuadraticForm::add_diagonal(int variable, std::span<const int> dimensions, std::span<double> sum) const {
  std::size_t rows = 1;
  for (const int other : variables) rows += static_cast<std::size_t>(dimensions[static_cast<std::size_t>(other)]);
  std::size_t at = 0;
  for (const int other : variables) {
    for (int i = 0; i < dimensions[static_cast<std::size_t>(other)]; ++i) {
      if (other == variable) sum[static_cast<std::size_t>(i)] += lower[at];
      at += rows--;
    }
  }
}

void EliminationFront::begin(std::span<const int> variables, std::size_t frontals, std::span<const int> dimensions) {
  place_of_.resize(dimensions.size());
  rows_ = 0;
  frontal_rows_ = 0;
  for (std::size_t i = 0; i < variables.size(); ++i) {
    const auto variable = static_cast<std::size_t>(variables[i]);
    place_of_[variable] = {rows_, dimensions[variable]};
    rows_ += dimensions[variable];
    if (i < frontals) frontal_rows_ = rows_;
  }
  others_.assign(variables.begin() + static_cast<std::ptrdiff_t>(frontals), variables.end());
  ++rows_;  // for g
  memory_.assign(static_cast<std::size_t>(rows_ * rows_), 0.0);
}

void EliminationFront::find_runs(const QuadraticForm& form) {
  runs_.clear();
  const auto append = [this](const Run& run) {
    if (!runs_.empty() && runs_.back().row + runs_.back().size == run.row) {
      runs_.back().size += run.size;
    } else {
      runs_.push_back(run);
    }
  };
  for (const int variable : form.variables) append(place_of_[static_cast<std::size_t>(variable)]);
  append({rows_ - 1, 1});
}

void EliminationFront::add(const QuadraticForm& form) {
  find_runs(form);
  auto front = sum();
  const double* in = form.lower.data();
  for (auto run = runs_.begin(); run != runs_.end(); ++run) {
    const Eigen::Index end = std::min(run->row + run->size, front.rows() - 1);
    for (Eigen::Index column = run->row; column < end; ++column) {
      double* const out = &front(0, column);
      for (Eigen::Index row = column; row < run->row + run->size; ++row) out[row] += *in++;
      for (auto other = run + 1; other != runs_.end(); ++other) {
        if (other->row > column) {
          for (Eigen::Index i = 0; i < other->size; ++i) out[other->row + i] += *in++;
        } else {
          for (Eigen::Index i = 0; i < other->size; ++i) front(column, other->row + i) += *in++;
        }
      }
    }
  }
}

Eigen::Index EliminationFront::eliminate(std::span<const double> scale) {
  auto front = sum();
  for (Eigen::Index first = 0; first < frontal_rows_; first += kBlock) {
    const Eigen::Index columns = std::min(kBlock, frontal_rows_ - first);
    const Eigen::Index failed = factorise(first, columns, scale);
    if (failed >= 0) return failed;
    const Eigen::Index rest = front.rows() - first - columns;
    front.bottomRightCorner(rest, rest)
        .selfadjointView<Eigen::Lower>()
        .rankUpdate(front.block(first + columns, first, rest, columns), -1.0);
  }
  return -1;
}

Eigen::Index EliminationFront::factorise(Eigen::Index first, Eigen::Index columns, std::span<const double> scale) {
  auto front = sum();
  const Eigen::Index rows = rows_;
  for (Eigen::Index k = first; k < first + columns; ++k) {
    const double pivot = front(k, k);
    if (!(pivot > kRounding * scale[static_cast<std::size_t>(k)])) return k;
    auto column = front.col(k).tail(rows - k);
    column /= std::sqrt(pivot);
    for (Eigen::Index j = k + 1; j < first + columns; ++j) {
      front.col(j).tail(rows - j) -= front(j, k) * front.col(k).tail(rows - j);
    }
  }
  return -1;
}

Eigen::MatrixXd EliminationFront::conditional() const { return sum().leftCols(frontal_rows_); }

QuadraticForm EliminationFront::rest() const {
  QuadraticForm form{others_, {}};
  const Eigen::Index rows = rows_ - frontal_rows_;
  form.lower.reserve(static_cast<std::size_t>(rows * (rows + 1) / 2 - 1));
  for (Eigen::Index column = frontal_rows_; column < rows_ - 1; ++column) {
    const double* const begin = memory_.data() + column * rows_ + column;
    form.lower.insert(form.lower.end(), begin, begin + (rows_ - column));
  }
  return form;
}

}  // namespace ignis
