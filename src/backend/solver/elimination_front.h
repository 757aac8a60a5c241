// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace ignis {

/// 1/2 x'Hx - g'x over some variables, each a block of scalars. Of the lower triangle of [H g; g' .] the columns of H,
/// one after the other: the last entry of each is that of g.
struct QuadraticForm {
  std::vector<int> variables;
  std::vector<double> lower;

  /// Adds what it holds on the scalars of `variable`, which must be one of its own: the diagonal of H.
  void add_diagonal(int variable, std::span<const int> dimensions, std::span<double> sum) const;
};

/// One step of multifrontal elimination (T. A. Davis, "Direct Methods for Sparse Linear Systems", SIAM 2006, ch. 4 and
/// 6): the sum of quadratic forms over the variables of a clique, of which the leading ones are eliminated by Cholesky.
/// Made to be used again and again, for it keeps its memory.
class EliminationFront {
 public:
  /// A new sum over `variables`; the first `frontals` of them are to be eliminated. `dimensions`: scalars of each
  /// variable, by its number.
  void begin(std::span<const int> variables, std::size_t frontals, std::span<const int> dimensions);

  /// Adds a form, all of whose variables must be among those of begin().
  void add(const QuadraticForm& form);

  /// Eliminates. `scale`: for each scalar that goes, the information that all its factors hold; where the rest of it is
  /// no more than rounding, nothing determines that scalar. Returns its row then, and -1 when all is well.
  [[nodiscard]] Eigen::Index eliminate(std::span<const double> scale);

  /// The columns of the Cholesky factor: L (frontal rows), those of the others, then L^-1 g.
  [[nodiscard]] Eigen::MatrixXd conditional() const;

  /// What is left over the other variables.
  [[nodiscard]] QuadraticForm rest() const;

 private:
  /// Rows of a form that lie side by side in the front as well.
  struct Run {
    Eigen::Index row;
    Eigen::Index size;
  };

  void find_runs(const QuadraticForm& form);
  /// Cholesky of `columns` columns from `first` on, without what follows them.
  Eigen::Index factorise(Eigen::Index first, Eigen::Index columns, std::span<const double> scale);

  [[nodiscard]] Eigen::Map<Eigen::MatrixXd> sum() { return {memory_.data(), rows_, rows_}; }
  [[nodiscard]] Eigen::Map<const Eigen::MatrixXd> sum() const { return {memory_.data(), rows_, rows_}; }

  std::vector<int> others_;    ///< variables that stay
  std::vector<Run> place_of_;  ///< by variable; those of others are left over from before
  std::vector<Run> runs_;
  std::vector<double> memory_;  ///< of the sum: lower triangle; the last row is g
  Eigen::Index rows_ = 0;
  Eigen::Index frontal_rows_ = 0;
};

}  // namespace ignis
