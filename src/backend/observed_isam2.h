// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtsam/nonlinear/ISAM2.h>

namespace ignis {

/// iSAM2 whose updates cost what they touch: GTSAM's own looks at every variable and clique in each of them, to find
/// what must be linearised anew, and does not tell what has moved. The same linearisation points and the same Bayes
/// tree. A variable that would move by less than the wildfire threshold stays where it is until its changes add up to
/// that; GTSAM 4.2 means to do so too, but moves it without telling its neighbours, so that they may fall behind by any
/// sum.
///
/// Needs Gauss-Newton and thresholds by the letter of the variables.
class ObservedIsam2 : public gtsam::ISAM2 {
 public:
  explicit ObservedIsam2(const gtsam::ISAM2Params& params);

  /// Offsets of the solution from the linearisation points, as of the last update.
  [[nodiscard]] const gtsam::VectorValues& solved_delta() const { return delta_; }

  struct Step {
    gtsam::FactorIndices new_factors;  ///< indices of the new factors, in their order
    gtsam::KeyVector moved;            ///< variables whose delta or linearisation point has changed
    bool relinearised = false;         ///< something was linearised anew
  };

  /// One update with its back-substitution.
  Step advance(const gtsam::NonlinearFactorGraph& factors, const gtsam::Values& values,
               const gtsam::FactorIndices& removed);

 private:
  /// Variables whose delta exceeds its threshold. Only those that moved since the last look can.
  [[nodiscard]] gtsam::KeySet above_threshold() const;
  /// `keys`, and the frontal variables of all cliques that have one of them in their separator.
  [[nodiscard]] gtsam::FastList<gtsam::Key> with_dependents(const gtsam::KeySet& keys) const;
  /// Moves the linearisation points of `keys` to the solution, and linearises their factors there.
  void relinearise(const gtsam::KeySet& keys);
  /// As getDelta() would do it; returns what has changed.
  gtsam::KeyVector back_substitute();
  /// Solves for the clique's frontal variables; false, and nothing done, when none changes by `threshold`.
  bool solve(const gtsam::GaussianConditional& conditional, double threshold);

  int relinearize_skip_;
  gtsam::KeyVector unchecked_;  ///< moved since the thresholds were looked at, some more than once
};

}  // namespace ignis
