// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/pose.h"
#include "frontend/filter/eskf.h"

namespace ignis {

/// Point-to-plane constraints summed in information form. Order of the 6: attitude (body axes), position (odom axes).
struct PoseInformation {
  Matrix6d information = Matrix6d::Zero();  ///< sum of h h^T / r
  Vector6d gradient = Vector6d::Zero();     ///< sum of h z / r
  int count = 0;

  void add(const Vector6d& h, double residual, double variance) {
    const Vector6d weighted = h * (1.0 / variance);
    information += weighted * h.transpose();
    gradient += weighted * residual;
    ++count;
  }
  /// Keeps the part that lies in the image of the projector (see degeneracy.h).
  [[nodiscard]] PoseInformation projected(const Matrix6d& projector) const;
};

/// One Gauss-Newton step of the iterated error-state update.
struct UpdateStep {
  ErrorVector step = ErrorVector::Zero();                    ///< error that moves the iterate
  ErrorCovariance covariance = ErrorCovariance::Identity();  ///< posterior, in the tangent space of the iterate
  bool ok = false;                                           ///< false: the result is not finite or not positive
};

/// Minimises |x - prior|^2 in the prior's covariance plus the constraints, linearised at the iterate, where
/// `deviation` = difference(prior, iterate). With the constraints in six columns only, the 17x17 system reduces to one
/// 6x6 solve, and the prior covariance is never inverted:
///   M = (I + A P66)^-1 A,  P+ = P - P6 M P6^T,  step = -P+6 b - (d - P6 M d6).
/// Equal to processing the points one at a time with scalar Kalman gains.
/// Equations: W. Xu, F. Zhang, "FAST-LIO", RA-L 2021, eqs. 16-20, rearranged with the matrix inversion lemma.
///
/// `considered` projects on the part of the error that the constraints must not correct although it is correlated with
/// what they observe; its uncertainty stays, and so does what the rest owes to it (S. F. Schmidt, "Application of
/// state-space methods to navigation problems", Advances in Control Systems 3, 1966).
[[nodiscard]] UpdateStep information_update(const ErrorCovariance& prior_covariance, const ErrorVector& deviation,
                                            const PoseInformation& constraints,
                                            const ErrorCovariance& considered = ErrorCovariance::Zero());

/// How far a scan lies from the prediction.
struct Innovation {
  double squared = 0.0;  ///< normalised by its covariance; `directions` on average when all covariances are true
  int directions = 0;    ///< degrees of freedom: directions of the pose that the constraints say anything about
};

/// Normalised innovation squared (NIS) of constraints linearised at the prediction. The gradient H^T R^-1 z has the
/// covariance A P A + A with A = H^T R^-1 H: no matrix of the size of the scan is needed, and the parts of z that no
/// pose could explain (residuals within the planes' own noise) do not count.
[[nodiscard]] Innovation normalised_innovation(const Matrix6d& pose_covariance, const PoseInformation& constraints);

}  // namespace ignis
