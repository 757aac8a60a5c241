// SPDX-License-Identifier: Apache-2.0
#include "frontend/degeneracy.h"

#include <algorithm>
#include <cmath>
#include <format>

#include <Eigen/Eigenvalues>

namespace ignis {

DegeneracyAnalysis analyse_degeneracy(const Matrix6d& sensitivity, const Matrix6d& noise,
                                      const DegeneracyLimits& limits) {
  Vector6d scale = Vector6d::Ones();
  scale.head<3>().setConstant(limits.length_m);
  const Vector6d inverse_scale = scale.cwiseInverse();
  const Matrix6d scaled = inverse_scale.asDiagonal() * sensitivity * inverse_scale.asDiagonal();
  const Matrix6d scaled_noise = inverse_scale.asDiagonal() * noise * inverse_scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(scaled);

  DegeneracyAnalysis analysis;
  analysis.eigenvalues = solver.eigenvalues();
  Matrix6d weighted = Matrix6d::Zero();
  Matrix6d observed = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i) {
    const Vector6d direction = solver.eigenvectors().col(i);
    const double value = analysis.eigenvalues[i];
    analysis.noise[i] = direction.dot(scaled_noise * direction);
    const bool blind = value < limits.min_sensitivity;
    const double kept = blind ? 0.0 : std::sqrt(std::max(1.0 - analysis.noise[i] / value, 0.0));
    const Matrix6d part = kept * direction * direction.transpose();
    weighted += part;
    if (blind || value < limits.min_signal_to_noise * analysis.noise[i]) {
      analysis.degenerate.push_back(direction);
      ++analysis.degenerate_directions;
    } else {
      observed += part;
    }
  }
  analysis.weighting = inverse_scale.asDiagonal() * weighted * scale.asDiagonal();
  analysis.projector = inverse_scale.asDiagonal() * observed * scale.asDiagonal();
  return analysis;
}

std::string describe(const DegeneracyAnalysis& analysis) {
  std::string words;
  for (const Vector6d& direction : analysis.degenerate) {
    const bool shift = direction.tail<3>().norm() >= direction.head<3>().norm();
    Eigen::Vector3d axis = (shift ? direction.tail<3>() : direction.head<3>()).normalized();
    // A direction has no sign; the largest component is shown positive so that it reads the same in every scan.
    Eigen::Index largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    if (axis[largest] < 0.0) axis = -axis;
    words += std::format("{}{} ({:.2f}, {:.2f}, {:.2f})", words.empty() ? "" : "; ",
                         shift ? "position along odom" : "turn about body", axis.x(), axis.y(), axis.z());
  }
  return words;
}

}  // namespace ignis
