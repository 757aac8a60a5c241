// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>

#include <Eigen/Core>

namespace ignis {

/// Largest whole number that is not above `value`, which must lie within the range of an int. std::floor is a call into
/// the C library on a baseline x86-64, and grids ask for it millions of times a second.
template <std::floating_point Real>
[[nodiscard]] constexpr int floor_to_int(Real value) {
  const int towards_zero = static_cast<int>(value);
  return towards_zero - (value < static_cast<Real>(towards_zero) ? 1 : 0);
}

/// The cell of a cubic grid, in units of its edge, that a point with coordinates in the same units lies in.
template <std::floating_point Real>
[[nodiscard]] Eigen::Vector3i cell_of(const Eigen::Matrix<Real, 3, 1>& point_in_edges) {
  return {floor_to_int(point_in_edges.x()), floor_to_int(point_in_edges.y()), floor_to_int(point_in_edges.z())};
}

}  // namespace ignis
