// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "backend/factors/information.h"

/// Loops as linear measurements beside each other, around where the graph stands: what each of them would cost, and
/// what becomes of the others' costs when one enters or leaves. Costs no solver, so sets of loops can be tried.
namespace ignis {

class LoopEvidence {
 public:
  struct Part {
    WhiteningRows rows;
    bool is_in = false;  ///< in the graph
  };

  /// Six rows for each loop, attitude before position, body axes of its later end: `covariance` of the relative poses
  /// between the ends as the graph knows them, `error` of these beside what the loops claim.
  LoopEvidence(std::vector<Part> parts, Eigen::MatrixXd covariance, Eigen::VectorXd error)
      : parts_(std::move(parts)), covariance_(std::move(covariance)), error_(std::move(error)) {}

  [[nodiscard]] std::size_t size() const { return parts_.size(); }
  [[nodiscard]] bool is_in(std::size_t i) const { return parts_[i].is_in; }
  [[nodiscard]] Eigen::Index directions(std::size_t i) const { return parts_[i].rows.rows(); }

  /// By how much the chi-square of the graph would fall without a loop that is in it, or rise with one that is not:
  /// e'(I - C)^-1 e or e'(I + C)^-1 e, with its whitened error e and covariance C. (R. D. Cook, S. Weisberg, "Residuals
  /// and Influence in Regression", 1982, section 2.2.)
  [[nodiscard]] double cost(std::size_t i) const;

  /// Of the relative pose between its ends.
  [[nodiscard]] Matrix6d covariance(std::size_t i) const;

  /// A loop that is in the graph leaves it, another enters it.
  void move(std::size_t i);

 private:
  [[nodiscard]] Eigen::MatrixXd innovation(std::size_t i) const;

  std::vector<Part> parts_;
  Eigen::MatrixXd covariance_;
  Eigen::VectorXd error_;
};

}  // namespace ignis
