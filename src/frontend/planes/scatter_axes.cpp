// SPDX-License-Identifier: Apache-2.0
#include "frontend/planes/scatter_axes.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace ignis {
namespace {

constexpr int kMaxSteps = 40;
constexpr double kConverged = 1e-8;  // of the trace: the step after it would be of the order of its square
constexpr double kParallel = 1e-20;  // squared sine between rows that say nothing about their normal
constexpr double kNothing = 1e-300;  // a trace that is none

/// Smallest eigenvalue of a matrix of trace 1.
double smallest_root(const Eigen::Matrix3d& A) {
  const double minors = A(0, 0) * A(1, 1) - A(0, 1) * A(0, 1) + A(0, 0) * A(2, 2) - A(0, 2) * A(0, 2) +
                        A(1, 1) * A(2, 2) - A(1, 2) * A(1, 2);
  const double determinant = A(0, 0) * (A(1, 1) * A(2, 2) - A(1, 2) * A(1, 2)) -
                             A(0, 1) * (A(0, 1) * A(2, 2) - A(1, 2) * A(0, 2)) +
                             A(0, 2) * (A(0, 1) * A(1, 2) - A(1, 1) * A(0, 2));
  double root = 0.0;
  for (int step = 0; step < kMaxSteps; ++step) {
    // det(A - x I) = determinant - minors x + x^2 - x^3
    const double value = determinant + root * (-minors + root * (1.0 - root));
    const double slope = -minors + root * (2.0 - 3.0 * root);
    if (!(slope < 0.0) || !(value > 0.0)) break;
    const double change = -value / slope;
    root += change;
    if (change < kConverged) break;
  }
  return root;
}

Eigen::Vector3d across(const Eigen::Vector3d& direction) {
  Eigen::Index least = 0;
  direction.cwiseAbs().minCoeff(&least);
  return direction.cross(Eigen::Vector3d::Unit(least)).normalized();
}

/// Unit vector that the rows of a singular symmetric matrix have in common as their normal.
Eigen::Vector3d null_vector(const Eigen::Matrix3d& M) {
  const Eigen::Vector3d normals[] = {M.col(0).cross(M.col(1)), M.col(0).cross(M.col(2)), M.col(1).cross(M.col(2))};
  const Eigen::Vector3d& best = *std::ranges::max_element(normals, {}, [](const auto& n) { return n.squaredNorm(); });
  Eigen::Index longest = 0;
  const double length2 = M.colwise().squaredNorm().maxCoeff(&longest);
  if (best.squaredNorm() > kParallel * length2 * length2) return best.normalized();
  return length2 > 0.0 ? across(M.col(longest)) : Eigen::Vector3d::UnitX();
}

}  // namespace

ScatterAxes scatter_axes(const Eigen::Matrix3d& scatter) {
  const double trace = scatter.trace();
  if (!(trace > kNothing)) return {Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
  const Eigen::Matrix3d A = scatter / trace;
  const double smallest = smallest_root(A);
  const Eigen::Vector3d normal = null_vector(A - smallest * Eigen::Matrix3d::Identity());

  const Eigen::Vector3d u = across(normal);
  const Eigen::Vector3d v = normal.cross(u);
  const Eigen::Vector3d Au = A * u;
  const double uu = u.dot(Au);
  const double uv = v.dot(Au);
  const double vv = v.dot(A * v);
  const double mean = 0.5 * (uu + vv);
  const double half = 0.5 * (uu - vv);
  const double radius = std::sqrt(half * half + uv * uv);
  // Of the two forms of the vector to mean + radius the one without cancellation.
  Eigen::Vector2d major = half > 0.0 ? Eigen::Vector2d(half + radius, uv) : Eigen::Vector2d(uv, radius - half);
  major = radius > 0.0 ? major.normalized() : Eigen::Vector2d::UnitX();

  ScatterAxes axes;
  axes.values = trace * Eigen::Vector3d(smallest, mean - radius, mean + radius);
  axes.vectors << normal, major.x() * v - major.y() * u, major.x() * u + major.y() * v;
  return axes;
}

}  // namespace ignis
