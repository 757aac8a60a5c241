// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace ignis {

/// Eigenvalues of a scatter matrix, ascending, and unit eigenvectors in the same order.
struct ScatterAxes {
  Eigen::Vector3d values;
  Eigen::Matrix3d vectors;  ///< columns, orthogonal, signs arbitrary
};

/// Eigen-decomposition of a symmetric positive semidefinite 3x3 matrix, made for planes: no trigonometry.
///
/// The smallest root of the characteristic polynomial by Newton's method from zero, which lies left of all roots, where
/// every step falls short of the root and none overshoots (Atkinson, An Introduction to Numerical Analysis, 2.2); its
/// vector as the longest cross product of two rows of (A - lambda I); the other two within the plane across it, where
/// the problem is 2x2. Accurate to about 1e-14 of the trace where the smallest value stands apart. Where all three are
/// nearly equal the steps only halve the distance; they end after 40, with the vectors still orthogonal.
[[nodiscard]] ScatterAxes scatter_axes(const Eigen::Matrix3d& scatter);

}  // namespace ignis
