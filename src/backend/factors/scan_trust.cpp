// SPDX-License-Identifier: Apache-2.0
#include "backend/factors/scan_trust.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace ignis {
namespace {

// Chosen for the NEES of the smoothed pose in corridor, open hall, hall and rooms (docs/results/graph_consistency.md).
constexpr double kWeak = 0.3;       // information relative to the best, of which two thirds count
constexpr double kWeakShare = 0.1;  // of the weakest that counts, before the best is brought to 1

double best(const Eigen::Matrix3d& information) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(information, Eigen::EigenvaluesOnly).eigenvalues()(2);
}

/// 1 from the best known direction on, an eighth far below kWeak.
double share(double relative) {
  const auto curve = [](double value) { return (value + kWeakShare * kWeak) / (value + kWeak); };
  return std::min(1.0, curve(relative) / curve(1.0));
}

}  // namespace

Matrix6d trusted_information(const Matrix6d& scan_information) {
  const double attitude = best(scan_information.topLeftCorner<3, 3>());
  const double position = best(scan_information.bottomRightCorner<3, 3>());
  if (attitude <= 0.0 || position <= 0.0) return scan_information;  // nothing to compare with
  Vector6d root;
  root << Eigen::Vector3d::Constant(std::sqrt(attitude)), Eigen::Vector3d::Constant(std::sqrt(position));
  const Vector6d unit = root.cwiseInverse();
  const Matrix6d relative = unit.asDiagonal() * scan_information * unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(relative);
  // Negative values are left over from a subtraction and mean nothing.
  const auto weigh = [](double value) { return value > 0.0 ? value * share(value) : 0.0; };
  const Matrix6d axes = root.asDiagonal() * eigen.eigenvectors();
  return axes * eigen.eigenvalues().unaryExpr(weigh).asDiagonal() * axes.transpose();
}

}  // namespace ignis
