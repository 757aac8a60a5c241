// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/lifted_problem.h"

#include <Eigen/Eigenvalues>

namespace ignis {
namespace {

/// What a link says: the pose at its end is A times the one at its beginning, position above attitude.
Eigen::Matrix2cd relation(const PoseGraphLink& link, std::complex<double> /*plane*/) {
  Eigen::Matrix2cd A = Eigen::Matrix2cd::Identity();
  A(0, 1) = {link.t_from_to.x(), link.t_from_to.y()};
  A(1, 1) = {link.R_from_to(0, 0), link.R_from_to(1, 0)};
  return A;
}

Eigen::Matrix4d relation(const PoseGraphLink& link, double /*space*/) {
  Eigen::Matrix4d A = Eigen::Matrix4d::Identity();
  A.topRightCorner<1, 3>() = link.t_from_to.transpose();
  A.bottomRightCorner<3, 3>() = link.R_from_to.transpose();
  return A;
}

}  // namespace

template <class Scalar>
LiftedProblem<Scalar>::LiftedProblem(const PoseGraph& graph) : positions_(std::ssize(graph.vertices) - 1) {
  Entries entries;
  for (const PoseGraphLink& link : links_of(graph)) add(link, entries);
  const Eigen::Index attitudes = kRows * poses();
  matrix_.resize(positions_ + attitudes, positions_ + attitudes);
  matrix_.setFromTriplets(entries.begin(), entries.end());
  lever_ = matrix_.block(0, positions_, positions_, attitudes);
  mean_weight_ = matrix_.diagonal().tail(attitudes).real().mean();
  of_positions_.compute(Sparse(matrix_.block(0, 0, positions_, positions_)));
  of_all_.compute(held(0.0));
  determined_ = of_positions_.info() == Eigen::Success && of_all_.info() == Eigen::Success;
}

template <class Scalar>
void LiftedProblem<Scalar>::add(const PoseGraphLink& link, Entries& entries) const {
  constexpr Eigen::Index kPose = kRows + 1;
  using PoseBlock = Eigen::Matrix<Scalar, kPose, kPose>;
  const PoseBlock A = relation(link, Scalar());
  Eigen::Matrix<double, kPose, 1> weights;
  // Two matrices of rotations that are an angle apart differ by twice its square.
  weights << link.position_weight, Eigen::Matrix<double, kRows, 1>::Constant(link.attitude_weight / (kPlanar ? 1 : 2));
  const PoseBlock WA = weights.asDiagonal() * A;
  const auto put = [&](Eigen::Index pose, Eigen::Index other, const PoseBlock& block) {
    for (Eigen::Index i = 0; i < kPose; ++i) {
      for (Eigen::Index k = 0; k < kPose; ++k) {
        const Eigen::Index row = row_of(pose, i);
        const Eigen::Index column = row_of(other, k);
        if (row >= 0 && column >= 0 && block(i, k) != Scalar()) entries.emplace_back(row, column, block(i, k));
      }
    }
  };
  put(link.to, link.to, PoseBlock(weights.template cast<Scalar>().asDiagonal()));
  put(link.from, link.from, A.adjoint() * WA);
  put(link.to, link.from, -WA);
  put(link.from, link.to, -WA.adjoint());
}

template <class Scalar>
Eigen::Index LiftedProblem<Scalar>::row_of(Eigen::Index pose, Eigen::Index row) const {
  return row == 0 ? pose - 1 : positions_ + kRows * pose + row - 1;
}

/// Positive definite, with so much more weight on every attitude.
template <class Scalar>
typename LiftedProblem<Scalar>::Sparse LiftedProblem<Scalar>::held(double attitude_weight) const {
  Sparse held = matrix_;
  for (Eigen::Index row = positions_; row < rows(); ++row) {
    held.coeffRef(row, row) += attitude_weight + (row < positions_ + kRows ? mean_weight_ : 0.0);
  }
  return held;
}

template <class Scalar>
void LiftedProblem<Scalar>::press(double share) {
  pressure_ = share * mean_weight_;
  of_pressed_.compute(held(pressure_));
}

template <class Scalar>
typename LiftedProblem<Scalar>::Matrix LiftedProblem<Scalar>::times(const Matrix& point) const {
  Matrix product = matrix_ * point;
  const Eigen::Index attitudes = rows() - positions_;
  product.bottomRightCorner(attitudes, point.cols() - kRows) +=
      pressure_ * point.bottomRightCorner(attitudes, point.cols() - kRows);
  return product;
}

template <class Scalar>
void LiftedProblem<Scalar>::place(Matrix& point) const {
  point.topRows(positions_) = -of_positions_.solve(lever_ * point.bottomRows(rows() - positions_));
}

/// Takes off what would bend the rows out of orthonormality.
template <class Scalar>
void LiftedProblem<Scalar>::project(const Matrix& point, Matrix& step) const {
  for (Eigen::Index i = 0; i < poses(); ++i) {
    const Block along = attitude(step, i) * attitude(point, i).adjoint();
    attitude(step, i) -= 0.5 * (along + along.adjoint()) * attitude(point, i);
  }
}

template <class Scalar>
typename LiftedProblem<Scalar>::Matrix LiftedProblem<Scalar>::point(Matrix attitudes) const {
  for (Eigen::Index i = 0; i < poses(); ++i) {
    const Block square = attitude(attitudes, i) * attitude(attitudes, i).adjoint();
    attitude(attitudes, i) =
        (Eigen::SelfAdjointEigenSolver<Block>(square).operatorInverseSqrt() * attitude(attitudes, i)).eval();
  }
  place(attitudes);
  return attitudes;
}

template <class Scalar>
double LiftedProblem<Scalar>::cost(const Matrix& point) const {
  return 0.5 * dot(point, times(point));
}

template <class Scalar>
typename LiftedProblem<Scalar>::Slope LiftedProblem<Scalar>::slope(const Matrix& point) const {
  Slope slope{times(point), {}};
  slope.constraint.reserve(static_cast<std::size_t>(poses()));
  for (Eigen::Index i = 0; i < poses(); ++i) {
    const Block along = attitude(slope.gradient, i) * attitude(point, i).adjoint();
    slope.constraint.push_back(0.5 * (along + along.adjoint()));
  }
  project(point, slope.gradient);
  clear_positions(slope.gradient);
  return slope;
}

template <class Scalar>
typename LiftedProblem<Scalar>::Matrix LiftedProblem<Scalar>::curvature(const Matrix& point, const Slope& slope,
                                                                        const Matrix& step) const {
  Matrix change = times(step);
  for (Eigen::Index i = 0; i < poses(); ++i) {
    attitude(change, i) -= slope.constraint[static_cast<std::size_t>(i)] * attitude(step, i);
  }
  project(point, change);
  clear_positions(change);
  return change;
}

template <class Scalar>
typename LiftedProblem<Scalar>::Matrix LiftedProblem<Scalar>::free_step(const Matrix& point,
                                                                        const Matrix& gradient) const {
  Matrix step(gradient.rows(), gradient.cols());
  const Eigen::Index others = gradient.cols() - kRows;
  step.leftCols(kRows) = of_all_.solve(gradient.leftCols(kRows));
  step.rightCols(others) = (pressure_ > 0.0 ? of_pressed_ : of_all_).solve(gradient.rightCols(others));
  project(point, step);
  place(step);
  return step;
}

template class LiftedProblem<double>;
template class LiftedProblem<std::complex<double>>;

}  // namespace ignis
