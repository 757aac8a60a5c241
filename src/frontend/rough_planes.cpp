// SPDX-License-Identifier: Apache-2.0
#include "frontend/rough_planes.h"

#include <algorithm>

#include <Eigen/LU>

namespace ignis {
namespace {

constexpr double kHardlyAny = 1e-3;  // planes: keeps the sum invertible where nothing faces a direction

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

void SmoothSupport::finish() { looseness_ = (planes_ + kHardlyAny * Eigen::Matrix3d::Identity()).inverse(); }

double SmoothSupport::weight(const Eigen::Vector3d& normal, double smoothness) const {
  // The information that the planes have of a shift along the normal while the other directions are free: what they
  // hold of an oblique one is no more than what they hold of its weakest part.
  const double holding = 1.0 / normal.dot(looseness_ * normal);
  const double need = enough_ / (enough_ + holding);
  const double strict = strict_smoothness(smoothness);
  return strict + need * (smoothness - strict);
}

}  // namespace ignis
