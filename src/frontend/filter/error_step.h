// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "frontend/filter/eskf.h"

namespace ignis {

/// What one step of the prediction does to the error of the state. It depends on the nominal state alone, so one step
/// carries all covariances that are kept for it.
class ErrorStep {
 public:
  /// As predict, from `state` over dt > 0 [s].
  ErrorStep(const NavState& state, const InertialInput& input, double dt, const FrontendConfig& config,
            double noise_scale);

  /// The covariance at the step's end, exactly symmetric: F P F^T + noise, without the products with zeros, which are
  /// half of them.
  void carry(ErrorCovariance& covariance) const;

 private:
  static constexpr int kMoving = 9;  ///< biases and gravity stay: the rows of F below are those of the identity
  static constexpr int kConstant = kErrorSize - kMoving;
  /// Rows of a whole number of vector registers, so that products need no rest and lie on the bounds of lines.
  static constexpr int kPaddedError = 18;
  static constexpr int kPaddedMoving = 10;

  ErrorCovariance F_;
  double dt_;                                            ///< [s]
  Eigen::Matrix<double, kMoving, kMoving> white_noise_;  ///< of the samples
  double gyro_bias_variance_;                            ///< that the walks of the biases add
  double accel_bias_variance_;
};

}  // namespace ignis
