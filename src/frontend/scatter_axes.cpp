// SPDX-License-Identifier: Apache-2.0
#include "frontend/scatter_axes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

namespace ignis {
namespace {

constexpr std::size_t kTogether = 4;
constexpr int kMaxSteps = 40;
constexpr double kConverged = 1e-8;  // of the trace: the step after it would be of the order of its square
constexpr double kParallel = 1e-20;  // squared sine between rows that say nothing about their normal
constexpr double kNothing = 1e-300;  // a trace that is none

/// Four numbers side by side.
using Lanes = double __attribute__((vector_size(32)));

/// Smallest eigenvalues of four matrices of trace 1 by their sums of principal minors and determinants. Each step waits
/// for a division: four wait together.
void smallest_roots(const Lanes& minors, const Lanes& determinant, Lanes& root) {
  root = Lanes{};
  auto is_open = root == root;
  for (int step = 0; step < kMaxSteps; ++step) {
    // det(A - x I) = determinant - minors x + x^2 - x^3
    const Lanes value = determinant + root * (-minors + root * (1.0 - root));
    const Lanes slope = -minors + root * (2.0 - 3.0 * root);
    is_open &= (slope < 0.0) & (value > 0.0);
    const Lanes change = is_open ? -value / slope : Lanes{};
    root += change;
    is_open &= ~(change < kConverged);
    if ((is_open[0] | is_open[1] | is_open[2] | is_open[3]) == 0) break;
  }
}

double sum_of_minors(const Eigen::Matrix3d& A) {
  return A(0, 0) * A(1, 1) - A(0, 1) * A(0, 1) + A(0, 0) * A(2, 2) - A(0, 2) * A(0, 2) + A(1, 1) * A(2, 2) -
         A(1, 2) * A(1, 2);
}

double determinant(const Eigen::Matrix3d& A) {
  return A(0, 0) * (A(1, 1) * A(2, 2) - A(1, 2) * A(1, 2)) - A(0, 1) * (A(0, 1) * A(2, 2) - A(1, 2) * A(0, 2)) +
         A(0, 2) * (A(0, 1) * A(1, 2) - A(1, 1) * A(0, 2));
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

/// The axes of a scatter matrix of this trace, whose share A of it has this smallest eigenvalue.
ScatterAxes axes_by_smallest(const Eigen::Matrix3d& A, double trace, double smallest) {
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

}  // namespace

ScatterAxes scatter_axes(const Eigen::Matrix3d& scatter) {
  ScatterAxes axes;
  scatter_axes({&scatter, 1}, {&axes, 1});
  return axes;
}

void scatter_axes(std::span<const Eigen::Matrix3d> scatters, std::span<ScatterAxes> axes) {
  for (std::size_t begin = 0; begin < scatters.size(); begin += kTogether) {
    const std::size_t count = std::min(kTogether, scatters.size() - begin);
    std::array<Eigen::Matrix3d, kTogether> A;
    std::array<double, kTogether> traces{};
    Lanes minors{};
    Lanes determinants{};
    for (std::size_t i = 0; i < count; ++i) {
      traces[i] = scatters[begin + i].trace();
      A[i] = scatters[begin + i] / traces[i];
      minors[i] = sum_of_minors(A[i]);
      determinants[i] = determinant(A[i]);
    }
    Lanes smallest;
    smallest_roots(minors, determinants, smallest);
    for (std::size_t i = 0; i < count; ++i) {
      const bool is_extended = traces[i] > kNothing;
      axes[begin + i] = is_extended ? axes_by_smallest(A[i], traces[i], smallest[i])
                                    : ScatterAxes{Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
    }
  }
}

}  // namespace ignis
