// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/information.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace ignis {
namespace {

/// Rows sqrt(weight(eigenvalue)) * eigenvector^T for the eigenvalues above `smallest`.
template <class Weight>
WhiteningRows rows_of(const Matrix6d& symmetric, double relative_limit, double absolute_limit, Weight weight) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(0.5 * (symmetric + symmetric.transpose()));
  const double limit = std::max(absolute_limit, relative_limit * eigen.eigenvalues()(5));
  WhiteningRows rows(6, 6);
  Eigen::Index count = 0;
  for (int i = 0; i < 6; ++i) {
    const double value = eigen.eigenvalues()(i);
    if (value > limit) rows.row(count++) = std::sqrt(weight(value)) * eigen.eigenvectors().col(i).transpose();
  }
  return rows.topRows(count);
}

}  // namespace

WhiteningRows whitening(const Matrix6d& information) {
  return rows_of(information, 1e-12, 0.0, [](double value) { return value; });
}

WhiteningRows whitening_with_floor(const Matrix6d& information, double sigma_rotation_rad, double sigma_position_m) {
  // With S = sqrt(floor): (L^-1 + S S)^-1 = S^-1 ((S L S)^-1 + I)^-1 S^-1, and S L S has no unit.
  Vector6d S;
  S << Eigen::Vector3d::Constant(sigma_rotation_rad), Eigen::Vector3d::Constant(sigma_position_m);
  const Matrix6d scaled = S.asDiagonal() * information * S.asDiagonal();
  const WhiteningRows rows = rows_of(scaled, 0.0, 1e-6, [](double value) { return value / (1.0 + value); });
  return rows * S.cwiseInverse().asDiagonal();
}

}  // namespace ignis
