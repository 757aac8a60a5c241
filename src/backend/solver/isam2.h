// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtsam/nonlinear/NonlinearFactorGraph.h>
#include <gtsam/nonlinear/Values.h>

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <map>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "backend/solver/elimination_front.h"

namespace ignis {

struct Isam2Settings {
  /// By the letter of the variables: offsets from the linearisation point that ask for a new one.
  std::map<char, gtsam::Vector> thresholds;
  int relinearize_skip = 1;         ///< updates between looks at them
  double wildfire_threshold = 0.0;  ///< smallest change of a variable that is passed on to its neighbours
};

/// iSAM2 with Gauss-Newton steps (M. Kaess et al., "iSAM2: Incremental smoothing and mapping using the Bayes tree",
/// IJRR 31(2), 2012) over GTSAM's factors and values: the linearisation points, the order of elimination and the
/// solution of gtsam::ISAM2. An update costs what it touches, and says what has moved. A linear factor is kept as a
/// quadratic form, which is what elimination adds up; everything linear lies in plain arrays, in one thread.
///
/// A variable that would move by less than the wildfire threshold stays where it is until its changes add up to that;
/// GTSAM 4.2 means to do so too, but moves it without telling its neighbours, so that they may fall behind by any sum.
///
/// After an exception the object must not be used any more.
class Isam2 {
 public:
  explicit Isam2(Isam2Settings settings) : settings_(std::move(settings)) {}

  struct Step {
    std::vector<std::size_t> new_factors;  ///< indices of the new factors, in their order; never used again
    gtsam::KeyVector moved;                ///< variables whose offset or linearisation point has changed
    gtsam::KeyVector relinearised;         ///< variables whose linearisation point has changed
  };

  /// One update with its back-substitution. Throws gtsam::IndeterminantLinearSystemException.
  Step advance(const gtsam::NonlinearFactorGraph& factors, const gtsam::Values& values,
               std::span<const std::size_t> removed);

  [[nodiscard]] bool exists(gtsam::Key key) const { return number_of_.contains(key); }

  /// Where the factors are linearised.
  [[nodiscard]] const gtsam::Values& linearisation_points() const { return theta_; }

  /// Offset of the solution from the linearisation point, as of the last update. The variable must exist.
  [[nodiscard]] gtsam::Vector offset(gtsam::Key key) const;

  /// Indices of its factors. The variable must exist.
  [[nodiscard]] const std::vector<std::size_t>& factors_of(gtsam::Key key) const;

  /// Covariance in the tangent space of the linearisation point. The variable must exist.
  [[nodiscard]] Eigen::MatrixXd covariance(gtsam::Key key) const;

  /// A variable's part in a sum: its offset times `factor`. All factors of a sum have the same number of rows.
  struct Term {
    gtsam::Key key = 0;
    Eigen::MatrixXd factor;
  };
  using Sum = std::vector<Term>;
  /// Covariance of a sum of terms of variables, which must exist: of relative poses, for example. Costs the way from
  /// these variables to the roots.
  [[nodiscard]] Eigen::MatrixXd covariance(std::span<const Term> terms) const;
  /// Covariances of such a sum with others, beside each other. Costs a back-substitution of the whole tree, however
  /// many they are.
  [[nodiscard]] Eigen::MatrixXd covariance(std::span<const Term> terms, std::span<const Sum> others) const;

  /// Scalars of quadratic forms that wait for the next elimination, and of conditionals.
  struct Size {
    std::size_t cliques = 0;
    std::size_t rests = 0;
    std::size_t conditionals = 0;
  };
  [[nodiscard]] Size size() const;

 private:
  struct Variable {
    gtsam::Key key = 0;
    std::size_t offset = 0;  ///< of its scalars in delta_
    int clique = -1;         ///< in which it is eliminated
    int in_top = 0;          ///< the last update that eliminated it anew
    int moved = 0;           ///< the last update that moved it
    std::vector<std::size_t> factors;
  };
  struct Factor {
    gtsam::NonlinearFactor::shared_ptr nonlinear;  ///< empty when removed
    QuadraticForm linear;
    int looked_at = 0;  ///< the last update that looked whether it belongs to what is eliminated anew
  };
  struct Clique {
    std::vector<int> variables;  ///< first those that are eliminated
    std::size_t frontals = 0;
    Eigen::MatrixXd conditional;  ///< EliminationFront::conditional()
    QuadraticForm rest;           ///< passed on to the parent
    int parent = -1;
    std::vector<int> children;
    bool is_new = false;  ///< not yet solved
    bool taken = false;   ///< out of the tree, in the course of an update
  };
  /// What an update eliminates anew.
  struct Top {
    std::vector<int> variables;             ///< ascending
    std::vector<int> orphans;               ///< cliques below that stay
    std::vector<const QuadraticForm*> sum;  ///< factors, then what the orphans pass on
  };

  [[nodiscard]] Variable& variable(int number) { return variables_[static_cast<std::size_t>(number)]; }
  [[nodiscard]] const Variable& variable(int number) const { return variables_[static_cast<std::size_t>(number)]; }
  [[nodiscard]] int dimension(int number) const { return dimensions_[static_cast<std::size_t>(number)]; }
  [[nodiscard]] Clique& clique(int number) { return cliques_[static_cast<std::size_t>(number)]; }
  [[nodiscard]] const Clique& clique(int number) const { return cliques_[static_cast<std::size_t>(number)]; }
  [[nodiscard]] Eigen::Map<const gtsam::Vector> delta(int number) const {
    return {&delta_[variable(number).offset], dimension(number)};
  }

  [[nodiscard]] std::vector<int> above_threshold() const;
  void add_variables(const gtsam::Values& values);
  void add_factor(const gtsam::NonlinearFactor::shared_ptr& factor);
  void remove_factor(std::size_t index);
  [[nodiscard]] QuadraticForm linearised(const gtsam::NonlinearFactor& factor) const;
  /// Moves the linearisation points of variables to the solution and linearises their factors there. Returns the
  /// variables of these.
  std::vector<int> relinearise(std::span<const int> numbers);

  /// Takes out what must be eliminated anew so that `marked` are.
  Top take_top(std::span<const int> marked);
  /// The cliques of `marked` and all between them and the roots; all cliques when that is nearly all. `fresh`: marked
  /// variables that have no clique.
  std::vector<int> take_cliques(std::span<const int> marked, std::size_t fresh);
  /// Factors within the top, and what its orphans pass on.
  void gather_sum(Top& top);
  void eliminate(const Top& top, std::span<const int> last);
  int new_clique();
  /// Eliminates the variables of a clique whose children are known.
  void fill_clique(int number, std::span<const QuadraticForm* const> forms);
  /// Information that all factors together hold on the scalars of `numbers`, into scale_.
  void find_scale(std::span<const int> numbers);

  std::vector<int> back_substitute();
  /// Solves for the clique's variables; false, and nothing done, when none changes by `threshold`.
  bool solve(const Clique& clique, double threshold);

  /// The cliques from those of `terms` to the roots, children before parents.
  [[nodiscard]] std::vector<int> way_to_roots(std::span<const Term> terms) const;
  /// Solves L Y = F on that way, for the F of `terms`: calls visit(clique, rows of Y of its frontals) at each clique.
  void climb(std::span<const Term> terms, auto visit) const;
  /// Solves L' X = Y for all variables: by clique, rows of Y of its frontals, or none where they are zero. Rows of
  /// `solution` are where those of delta_ are.
  void descend(std::span<const Eigen::MatrixXd> y_of, Eigen::MatrixXd& solution) const;
  [[nodiscard]] auto rows_of(int number, auto& matrix) const {
    return matrix.middleRows(static_cast<Eigen::Index>(variable(number).offset), dimension(number));
  }

  Isam2Settings settings_;
  int updates_ = 0;
  gtsam::Values theta_;
  std::unordered_map<gtsam::Key, int> number_of_;
  std::vector<Variable> variables_;
  std::vector<int> dimensions_;  ///< by variable
  std::vector<double> delta_;    ///< offsets of all variables, one after the other
  std::vector<Factor> factors_;
  std::deque<Clique> cliques_;
  std::vector<int> free_cliques_;  ///< places in cliques_
  std::vector<int> roots_;
  std::vector<int> unchecked_;  ///< variables that moved since the thresholds were looked at, some more than once
  EliminationFront front_;
  std::vector<double> scale_;
  gtsam::Vector solution_;  ///< offsets of a clique's variables
};

}  // namespace ignis
