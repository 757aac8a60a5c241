// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/SparseCholesky>
#include <complex>
#include <type_traits>
#include <vector>

#include "backend/pose_graph/pose_graph_links.h"

namespace ignis {

/// A pose graph with more room than there is: attitudes are orthonormal rows in `columns` dimensions, of which a pose
/// needs the first ones only. Wrong minima of the graph are left through the others (D. M. Rosen et al., "SE-Sync",
/// IJRR 38(2-3), 2019). In the plane a heading is a complex number, so that nothing is ever mirrored (T. Fan et al.,
/// "CPL-SLAM", T-RO 36(6), 2020): `Scalar` is complex there, and real for graphs in space.
///
/// A point has a row for the position of every pose but the first one, which stands at the origin, then those of the
/// attitudes. Positions are those of least cost for the attitudes. The cost is half of
/// sum kappa |Y_to - R' Y_from|^2 + tau |p_to - p_from - t' Y_from|^2, Y being transposed attitudes.
template <class Scalar>
class LiftedProblem {
 public:
  static constexpr bool kPlanar = !std::is_same_v<Scalar, double>;
  static constexpr Eigen::Index kRows = kPlanar ? 1 : 3;  ///< of an attitude
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using Block = Eigen::Matrix<Scalar, kRows, kRows>;

  explicit LiftedProblem(const PoseGraph& graph);

  /// Whether the edges hold every pose.
  [[nodiscard]] bool determined() const { return determined_; }
  [[nodiscard]] Eigen::Index rows() const { return matrix_.rows(); }
  [[nodiscard]] Eigen::Index poses() const { return positions_ + 1; }

  /// From here on the columns that no pose needs cost so much, as a share of the mean attitude's weight.
  void press(double share);

  /// Of attitudes whose rows need not be orthonormal yet, the nearest that are, and the positions.
  [[nodiscard]] Matrix point(Matrix attitudes) const;

  [[nodiscard]] double cost(const Matrix& point) const;

  struct Slope {
    Matrix gradient;                ///< along the attitudes' manifold; nothing is to be gained by positions
    std::vector<Block> constraint;  ///< what orthonormality takes off the matrix, per pose
  };
  [[nodiscard]] Slope slope(const Matrix& point) const;

  /// The change of the gradient with a step along the manifold.
  [[nodiscard]] Matrix curvature(const Matrix& point, const Slope& slope, const Matrix& step) const;

  /// About the step that would undo a gradient if attitudes were free, along the manifold.
  [[nodiscard]] Matrix free_step(const Matrix& point, const Matrix& gradient) const;

  [[nodiscard]] auto attitude(Matrix& point, Eigen::Index pose) const {
    return point.middleRows(positions_ + kRows * pose, kRows);
  }
  [[nodiscard]] auto attitude(const Matrix& point, Eigen::Index pose) const {
    return point.middleRows(positions_ + kRows * pose, kRows);
  }

  static double dot(const Matrix& a, const Matrix& b) { return std::real(a.conjugate().cwiseProduct(b).sum()); }

 private:
  using Sparse = Eigen::SparseMatrix<Scalar>;
  using Entries = std::vector<Eigen::Triplet<Scalar>>;

  void add(const PoseGraphLink& link, Entries& entries) const;
  [[nodiscard]] Eigen::Index row_of(Eigen::Index pose, Eigen::Index row) const;
  [[nodiscard]] Matrix times(const Matrix& point) const;
  void place(Matrix& point) const;
  void project(const Matrix& point, Matrix& step) const;
  void clear_positions(Matrix& gradient) const { gradient.topRows(positions_).setZero(); }
  [[nodiscard]] Sparse held(double attitude_weight) const;

  Eigen::Index positions_;
  Sparse matrix_;
  Sparse lever_;  ///< of the attitudes on the positions
  double mean_weight_ = 0.0;
  double pressure_ = 0.0;
  bool determined_ = false;
  Eigen::SimplicialLLT<Sparse> of_positions_;
  Eigen::SimplicialLLT<Sparse> of_all_;      ///< the first attitude held
  Eigen::SimplicialLLT<Sparse> of_pressed_;  ///< the same for the columns under pressure
};

extern template class LiftedProblem<double>;
extern template class LiftedProblem<std::complex<double>>;

}  // namespace ignis
