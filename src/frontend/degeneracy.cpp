// SPDX-License-Identifier: Apache-2.0
#include "frontend/degeneracy.h"

#include <Eigen/Eigenvalues>

namespace ignis {

DegeneracyAnalysis analyse_degeneracy(const Matrix6d& sensitivity, double length_m, double threshold) {
  Vector6d scale = Vector6d::Ones();
  scale.head<3>().setConstant(length_m);
  const Vector6d inverse_scale = scale.cwiseInverse();
  const Matrix6d scaled = inverse_scale.asDiagonal() * sensitivity * inverse_scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(scaled);

  DegeneracyAnalysis analysis;
  analysis.eigenvalues = solver.eigenvalues();
  Matrix6d observed = Matrix6d::Identity();
  for (int i = 0; i < 6; ++i) {
    if (analysis.eigenvalues[i] >= threshold) continue;
    const Vector6d direction = solver.eigenvectors().col(i);
    observed -= direction * direction.transpose();
    ++analysis.degenerate_directions;
  }
  analysis.projector = inverse_scale.asDiagonal() * observed * scale.asDiagonal();
  return analysis;
}

}  // namespace ignis
