// SPDX-License-Identifier: Apache-2.0
#include "frontend/matching/scan_update.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "common/so3.h"

namespace ignis {
namespace {

static_assert(kAttitude == 0, "rows and columns of attitude are the first three");

/// J P J^T, where J is the identity but for the block of attitude.
ErrorCovariance with_attitude_in(const Eigen::Matrix3d& coordinates, const ErrorCovariance& covariance) {
  ErrorCovariance result = covariance;
  for (int i = 0; i < 3; ++i) {
    result.row(i) = coordinates(i, 0) * covariance.row(0) + coordinates(i, 1) * covariance.row(1) +
                    coordinates(i, 2) * covariance.row(2);
  }
  const Eigen::Matrix<double, kErrorSize, 3> columns = result.leftCols<3>();
  for (int i = 0; i < 3; ++i) {
    result.col(i) =
        coordinates(i, 0) * columns.col(0) + coordinates(i, 1) * columns.col(1) + coordinates(i, 2) * columns.col(2);
  }
  return result;
}

}  // namespace

PoseInformation PoseInformation::projected(const Matrix6d& projector) const {
  PoseInformation result = *this;
  result.information = projector.transpose() * information * projector;
  result.gradient = projector.transpose() * gradient;
  return result;
}

UpdateStep information_update(const ErrorCovariance& prior_covariance, const ErrorVector& deviation,
                              const PoseInformation& constraints, const ErrorCovariance& considered) {
  // The prior's error in coordinates of the iterate's tangent space: only attitude is curved.
  const Eigen::Matrix3d to_iterate = so3::right_jacobian(deviation.segment<3>(kAttitude));
  const ErrorCovariance P = with_attitude_in(to_iterate, prior_covariance);
  ErrorVector d = deviation;
  d.segment<3>(kAttitude) =
      to_iterate.col(0) * deviation[0] + to_iterate.col(1) * deviation[1] + to_iterate.col(2) * deviation[2];

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
  update.step = full_step;
  if (considered.isZero(0.0)) {  // as nearly always: what follows would change nothing
    update.ok = update.ok && update.step.allFinite();
    return update;
  }
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
