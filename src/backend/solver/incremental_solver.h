// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/config_fields.h"
#include "common/pose.h"

namespace gtsam {
class NonlinearFactor;
class NonlinearFactorGraph;
class Pose3;
class Values;
}  // namespace gtsam

namespace ignis {

/// When iSAM2 linearises a variable anew. The usual 0.1 ends centimetres away from the optimum; these stay within
/// 0.1 mm of it.
struct SolverConfig {
  double relinearize_position_m = 0.01;
  double relinearize_rotation_rad = 0.001;
  double relinearize_velocity = 0.05;
  double relinearize_bias = 0.01;
  int relinearize_skip = 1;
  double wildfire_threshold = 5e-7;

  void visit_fields(this auto& self, auto& visit) {
    visit.number("relinearize_position_m", self.relinearize_position_m, {1e-6, 1.0}, "m",
                 "shift of a position that asks for a new linearisation");
    visit.number("relinearize_rotation_rad", self.relinearize_rotation_rad, {1e-6, 1.0}, "rad", "the same, attitude");
    visit.number("relinearize_velocity", self.relinearize_velocity, {1e-6, 10.0}, "m/s", "the same, velocity");
    visit.number("relinearize_bias", self.relinearize_bias, {1e-7, 10.0}, "m/s^2 or rad/s", "the same, biases");
    visit.integer("relinearize_skip", self.relinearize_skip, {1, 100}, "updates",
                  "updates between checks of the thresholds");
    visit.number("wildfire_threshold", self.wildfire_threshold, {0.0, 0.1}, "m, rad, m/s, ...",
                 "smallest change of a variable that is passed on to its neighbours");
  }
};

/// Number of a factor in the solver's own list; never reused.
using FactorId = std::size_t;

/// What became of a batch. A refused batch has left nothing behind.
struct SolverOutcome {
  bool accepted = false;
  std::string reason;             ///< why it was refused
  std::vector<FactorId> factors;  ///< of the batch, in its order
};

/// A prior that takes the place of factors.
struct SolverSummary {
  Eigen::MatrixXd covariance;  ///< joint, with all other variables of these factors in doubt
  Eigen::VectorXd offset;      ///< of its mean from the solution, so that the solution stays where it is
};

/// iSAM2 (M. Kaess et al., "iSAM2: Incremental smoothing and mapping using the Bayes tree", IJRR 31(2), 2012) that
/// survives its own exceptions. GTSAM's object is unusable after one, so factors and values are kept here as well; when
/// a batch makes it throw, a fresh iSAM2 is built from everything but that batch. Deterministic; for one thread.
///
/// Pose variables have the letter x, velocities v, biases b; poses in the plane p.
class IncrementalSolver {
 public:
  explicit IncrementalSolver(const SolverConfig& config);
  ~IncrementalSolver();
  IncrementalSolver(IncrementalSolver&&) noexcept;
  IncrementalSolver& operator=(IncrementalSolver&&) noexcept;

  /// Adds factors and new variables in one update. All or nothing. Refuses before GTSAM sees it: a variable that
  /// exists, a factor on an unknown variable, a factor whose error is not finite.
  [[nodiscard]] SolverOutcome add(const gtsam::NonlinearFactorGraph& factors, const gtsam::Values& values);

  /// Takes factors out again. Must not leave a variable without factors.
  [[nodiscard]] SolverOutcome remove(std::span<const FactorId> factors);

  /// Ends the estimation of variables: from now on they are known to be where the solution has them, and their factors
  /// say what they then say of the others. Later factors may name those of `known`, but not those of `forgotten`. What
  /// is left to speak of the variables of `instead` alone is taken out, for `instead` says all that. False when the
  /// graph cannot be solved then, and nothing has changed. Costs as much as building iSAM2 anew.
  [[nodiscard]] bool fix(std::span<const std::uint64_t> known, std::span<const std::uint64_t> forgotten,
                         const gtsam::NonlinearFactorGraph& instead);

  /// Variables that were fixed before, for a solver that begins anew.
  void add_fixed(const gtsam::Values& values);

  /// Variables that are known, and that no factor will name any more.
  void release(std::span<const std::uint64_t> known);

  /// What is known, and where.
  [[nodiscard]] const gtsam::Values& fixed() const;

  /// Further updates without news, after a large correction; fewer when nothing is left to linearise anew. False when
  /// the solver had to be rebuilt.
  bool settle(int updates);

  /// The current solution of what is not fixed; valid until the next call that changes the graph.
  [[nodiscard]] const gtsam::Values& estimate();

  /// Keys of the variables that the solution has moved since the last call, ascending.
  [[nodiscard]] std::vector<std::uint64_t> take_changed();

  /// Keys of the variables that are linearised elsewhere than at the last call, or new, or fixed since, ascending.
  [[nodiscard]] std::vector<std::uint64_t> take_relinearised();

  /// Where the factors are linearised. A solver that begins with these values and the same factors has the same
  /// solution.
  [[nodiscard]] const gtsam::Values& linearisation_points() const;

  /// The same, but only the variables `keys` are brought up to date: others may be older. They must exist.
  [[nodiscard]] const gtsam::Values& estimate_of(std::span<const std::uint64_t> keys);

  /// One pose of it, without the cost of all the others, fixed or not. The variable must exist.
  [[nodiscard]] gtsam::Pose3 pose(std::uint64_t key);

  /// Where the factors are linearised in one pose, fixed or not. The variable must exist.
  [[nodiscard]] gtsam::Pose3 linearisation_point(std::uint64_t key) const;

  /// Half chi-square at the current solution, of the whole graph, of one factor, and of one that is not in the graph.
  [[nodiscard]] double half_chi_square();
  [[nodiscard]] double half_chi_square(FactorId factor);
  [[nodiscard]] double half_chi_square(const gtsam::NonlinearFactor& factor);

  /// Covariance of one variable in its tangent space; nothing when it cannot be computed.
  [[nodiscard]] std::optional<Eigen::MatrixXd> marginal_covariance(std::uint64_t key) const;

  /// What those factors alone that name none but `keys` and what is fixed say of `wanted`, one below the other. Nothing
  /// where they leave something open.
  [[nodiscard]] std::optional<SolverSummary> summary_of(std::span<const std::uint64_t> keys,
                                                        std::span<const std::uint64_t> wanted);

  /// Two pose variables, of which one may be fixed.
  using KeyPair = std::pair<std::uint64_t, std::uint64_t>;

  /// Covariance of the relative poses of pairs of pose variables, six rows and columns for each, in body axes of the
  /// second of the pair, where the factors are linearised. Empty when it cannot be computed.
  [[nodiscard]] Eigen::MatrixXd relative_covariance(std::span<const KeyPair> pairs) const;

  /// The same of one of them with others: six rows, and six columns for each.
  [[nodiscard]] Eigen::MatrixXd relative_covariance(const KeyPair& pair, std::span<const KeyPair> others) const;

  /// How far the solution has moved the second pose of a pair against the first from where the factors are linearised,
  /// to first order: attitude then position, in body axes of the second. Both must exist.
  [[nodiscard]] Vector6d relative_offset(const KeyPair& pair) const;

  /// The factors in the graph. They are immutable, so copies of the list share them.
  [[nodiscard]] gtsam::NonlinearFactorGraph living_factors() const;

  /// Linearises everything anew at `values`, which must hold every variable that is not fixed. False when the solver
  /// refused them; then it goes on from where it was.
  [[nodiscard]] bool restart_at(const gtsam::Values& values);

  /// Why nothing is accepted any more: not even a fresh iSAM2 solves the factors. Empty while all is well.
  [[nodiscard]] const std::string& failure() const;

  /// Times that iSAM2 had to be built anew.
  [[nodiscard]] int rebuilds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ignis
