// SPDX-License-Identifier: Apache-2.0
#include "frontend/scan_update.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "common/so3.h"

namespace ignis {

PoseInformation PoseInformation::projected(const Matrix6d& projector) const {
  PoseInformation result = *this;
  result.information = projector.transpose() * information * projector;
  result.gradient = projector.transpose() * gradient;
  return result;
}

UpdateStep information_update(const ErrorCovariance& prior_covariance, const ErrorVector& deviation,
                              const PoseInformation& constraints, const ErrorCovariance& considered) {
  // The prior's error in coordinates of the iterate's tangent space: only attitude is curved.
  ErrorCovariance to_iterate = ErrorCovariance::Identity();
  to_iterate.block<3, 3>(kAttitude, kAttitude) = so3::right_jacobian(deviation.segment<3>(kAttitude));
  const ErrorCovariance P = to_iterate * prior_covariance * to_iterate.transpose();
  const ErrorVector d = to_iterate * deviation;

  const Matrix6d& A = constraints.information;
  const Eigen::Matrix<double, kErrorSize, 6> P6 = P.leftCols<6>();
  const Matrix6d damped = Matrix6d::Identity() + A * P.topLeftCorner<6, 6>();
  Matrix6d M = damped.partialPivLu().solve(A);
  M = (0.5 * (M + M.transpose())).eval();

  UpdateStep update;
  update.covariance = P - P6 * M * P6.transpose();
  update.ok = make_symmetric(update.covariance);
  const ErrorVector restored = d - P6 * (M * d.head<6>());
  const ErrorVector full_step = -(update.covariance.leftCols<6>() * constraints.gradient) - restored;
  // The gain K becomes (I - C) K; Joseph's form of the covariance for it is P - G + C G C^T with G = P6 M P6^T.
  update.step = full_step - considered * full_step;
  update.covariance += considered * (P - update.covariance) * considered.transpose();
  update.ok = update.ok && update.step.allFinite();
  return update;
}

Innovation normalised_innovation(const Matrix6d& pose_covariance, const PoseInformation& constraints) {
  constexpr double kBlind = 1e-9;  // relative to the best direction
  const Matrix6d& A = constraints.information;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(A * pose_covariance * A + A);
  const Vector6d along = solver.eigenvectors().transpose() * constraints.gradient;
  Innovation innovation;
  for (int i = 0; i < 6; ++i) {
    const double variance = solver.eigenvalues()[i];
    if (!(variance > kBlind * solver.eigenvalues()[5])) continue;
    innovation.squared += along[i] * along[i] / variance;
    ++innovation.directions;
  }
  return innovation;
}

}  // namespace ignis
