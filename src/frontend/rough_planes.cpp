// SPDX-License-Identifier: Apache-2.0
#include "frontend/rough_planes.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

namespace ignis {
namespace {

constexpr double kHardlyAny = 1e-3;  // planes: what a direction that nothing faces is taken to be held by

}  // namespace

double unexplained_variance(const PlaneFit& plane, double range_noise_m) {
  const double of_noise = range_noise_m * range_noise_m * std::max(plane.count - 3, 1) / std::max(plane.points, 1.0);
  return std::max(plane.scatter[0] - of_noise, 0.0);
}

double strict_smoothness(double smoothness) {
  const double square = smoothness * smoothness;
  return square * square;
}

void SmoothSupport::add(const Eigen::Vector3d& normal, double smoothness) {
  planes_ += strict_smoothness(smoothness) * normal * normal.transpose();
}

void SmoothSupport::finish() {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(planes_);
  directions_ = solver.eigenvectors();
  held_ = solver.eigenvalues().cwiseMax(kHardlyAny);
}

double SmoothSupport::weight(const Eigen::Vector3d& normal, double smoothness) const {
  // The information that the planes have of a shift along the normal while the other directions are free, 1 / (n^T A^-1
  // n): what they hold of an oblique one is no more than what they hold of its weakest part.
  const double loose = (directions_.transpose() * normal).cwiseAbs2().cwiseQuotient(held_).sum();
  const double need = enough_ * loose / (enough_ * loose + 1.0);
  const double strict = strict_smoothness(smoothness);
  return strict + need * (smoothness - strict);
}

}  // namespace ignis
