// SPDX-License-Identifier: Apache-2.0
#include "frontend/planes/rough_planes.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace ignis {
namespace {

// In a corridor smooth planes hold the way along it like 0.2 to 13, in rooms and halls like 10 to 50. With an exponent
// of 2 and 10 planes for enough, what the corridor's end said was drowned in one of three drives.
constexpr double kSteepness = 4.0;

}  // namespace

double unexplained_variance(const PlaneFit& plane, double range_noise_m) {
  const double of_noise = range_noise_m * range_noise_m * std::max(plane.count - 3, 1) / std::max(plane.points, 1.0);
  return std::max(plane.scatter[0] - of_noise, 0.0);
}

double strict_smoothness(double smoothness) {
  const double square = smoothness * smoothness;
  return square * square;
}

double SmoothSupport::sufficiency(double enough) const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(planes_, Eigen::EigenvaluesOnly);
  const double weakest = std::max(solver.eigenvalues()[0], 0.0);
  return 1.0 / (1.0 + std::pow(enough / weakest, kSteepness));
}

}  // namespace ignis
