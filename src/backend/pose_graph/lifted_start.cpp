// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/lifted_start.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>

#include "backend/pose_graph/chordal_start.h"
#include "backend/pose_graph/lifted_problem.h"

namespace ignis {
namespace {

constexpr Eigen::Index kMoreColumns = 1;    // further ones reach the same costs, later
constexpr double kOutOfThePlane = 0.3;      // sigma of what is added to the rows of each attitude at first
constexpr int kDescents = 200;              // steps at most before pressure grows
constexpr int kConjugate = 100;             // directions at most that one step is made of
constexpr double kConjugateDecrease = 0.1;  // of the gradient's norm, then the step is good enough
constexpr int kFlatSteps = 3;               // in a row, of no decrease that counts, end the descent
constexpr double kLeastGradient = 1e-12;    // squared, of the cost
constexpr double kLeastRadius = 1e-9;       // of the first one
constexpr double kFirstPressure = 1e-4;     // of the mean attitude's weight
constexpr double kLastPressure = 0.11;
constexpr double kPressedOut = 1e-6;  // mean square of what is left in the columns under pressure

/// In space a step costs ten times as much as in the plane.
struct Patience {
  double flat = 0.0;           ///< relative decrease of the cost that counts for nothing
  double more_pressure = 0.0;  ///< times as much as before
};
constexpr Patience kInThePlane{1e-5, 3.16};
constexpr Patience kInSpace{1e-4, 10.0};

/// Steps by truncated conjugate gradients within a trust region (T. Steihaug, SIAM J. Numer. Anal. 20(3), 1983).
template <class Scalar>
class TrustedDescent {
 public:
  using Problem = LiftedProblem<Scalar>;
  using Matrix = typename Problem::Matrix;

  TrustedDescent(const Problem& problem, double flat, const std::function<bool()>& goes_on)
      : problem_(problem), flat_(flat), goes_on_(goes_on) {}

  /// As low as it goes from `point`, or until it may not go on.
  Matrix run(Matrix point) {
    double cost = problem_.cost(point);
    double radius = 0.0;
    double least_radius = 0.0;
    int flat = 0;
    for (int i = 0; i < kDescents && flat < kFlatSteps && goes_on_(); ++i) {
      const typename Problem::Slope slope = problem_.slope(point);
      const Matrix free_step = problem_.free_step(point, slope.gradient);
      const double square = Problem::dot(slope.gradient, free_step);
      if (!(square > kLeastGradient * std::abs(cost))) break;
      if (radius == 0.0) {
        radius = 0.25 * std::sqrt(square);
        least_radius = kLeastRadius * radius;
      }
      const Step step = step_within(radius, point, slope, free_step);
      if (!(step.promise > 0.0)) break;
      Matrix next = problem_.point(point + step.step);
      const double next_cost = problem_.cost(next);
      const double kept_promise = (cost - next_cost) / step.promise;
      if (!(kept_promise >= 0.25)) radius *= 0.25;
      if (kept_promise > 0.75 && step.at_edge) radius *= 2.0;
      if (radius < least_radius) break;
      if (!(kept_promise > 0.05)) continue;
      flat = cost - next_cost < flat_ * cost ? flat + 1 : 0;
      cost = next_cost;
      point = std::move(next);
    }
    return point;
  }

 private:
  struct Step {
    Matrix step;
    double promise = 0.0;
    bool at_edge = false;
  };

  Step step_within(double radius, const Matrix& point, const typename Problem::Slope& slope,
                   const Matrix& free_step) const {
    Step result{Matrix::Zero(point.rows(), point.cols())};
    Matrix residual = slope.gradient;
    Matrix direction = -free_step;
    double square = Problem::dot(residual, free_step);
    const double enough = kConjugateDecrease * kConjugateDecrease * square;
    double step_step = 0.0;  // in the norm of the problem's matrix, as the other two
    double step_direction = 0.0;
    double direction_direction = square;
    for (int i = 0; i < kConjugate && square > enough && goes_on_(); ++i) {
      const Matrix bent = problem_.curvature(point, slope, direction);
      const double curvature = Problem::dot(direction, bent);
      const double length = square / curvature;
      const double reached = step_step + length * (2.0 * step_direction + length * direction_direction);
      result.at_edge = curvature <= 0.0 || reached >= radius * radius;
      const double part =
          result.at_edge
              ? (std::sqrt(step_direction * step_direction + direction_direction * (radius * radius - step_step)) -
                 step_direction) /
                    direction_direction
              : length;
      result.step += part * direction;
      residual += part * bent;
      if (result.at_edge) break;
      const Matrix preconditioned = problem_.free_step(point, residual);
      const double next = Problem::dot(residual, preconditioned);
      const double back = next / square;
      step_direction = back * (step_direction + length * direction_direction);
      direction_direction = next + back * back * direction_direction;
      step_step = reached;
      square = next;
      direction = -preconditioned + back * direction;
    }
    result.promise = -0.5 * (Problem::dot(slope.gradient, result.step) + Problem::dot(result.step, residual));
    return result;
  }

  const Problem& problem_;
  double flat_;
  const std::function<bool()>& goes_on_;
};

void set_attitude(const Eigen::Matrix3d& R, Eigen::Ref<Eigen::MatrixXd> rows) { rows.leftCols<3>() = R.transpose(); }
void set_attitude(const Eigen::Matrix3d& R, Eigen::Ref<Eigen::MatrixXcd> rows) { rows(0, 0) = {R(0, 0), R(1, 0)}; }

Eigen::Matrix3d attitude_in(const Eigen::MatrixXd& rows, bool mirrored) {
  return nearest_rotation((mirrored ? -1.0 : 1.0) * rows.transpose());
}
Eigen::Matrix3d attitude_in(const Eigen::MatrixXcd& rows, bool /*mirrored*/) {
  return Eigen::AngleAxisd(std::arg(rows(0, 0)), Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

void draw(std::mt19937& random, double& value) { value = std::normal_distribution<double>()(random); }
void draw(std::mt19937& random, std::complex<double>& value) {
  std::normal_distribution<double> normal;
  const double real = normal(random);
  value = {real, normal(random)};
}

/// The columns that hold most of the attitudes first.
template <class Scalar>
auto turned(const LiftedProblem<Scalar>& problem, const typename LiftedProblem<Scalar>::Matrix& point) {
  using Matrix = typename LiftedProblem<Scalar>::Matrix;
  const auto attitudes = point.bottomRows(LiftedProblem<Scalar>::kRows * problem.poses());
  const Matrix square = attitudes.adjoint() * attitudes;
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(square);
  return Matrix(point * eigen.eigenvectors().rowwise().reverse());
}

template <class Scalar>
typename LiftedProblem<Scalar>::Matrix first_point(const LiftedProblem<Scalar>& problem,
                                                   const std::vector<KeyframePose>& start) {
  using Problem = LiftedProblem<Scalar>;
  typename Problem::Matrix point = Problem::Matrix::Zero(problem.rows(), Problem::kRows + kMoreColumns);
  std::mt19937 random;  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same every time
  for (Scalar& value : point.reshaped()) {
    draw(random, value);
    value *= kOutOfThePlane;
  }
  for (Eigen::Index i = 0; i < problem.poses(); ++i) {
    typename Problem::Matrix rows = Problem::Matrix::Zero(Problem::kRows, point.cols());
    set_attitude(start[static_cast<std::size_t>(i)].T_map_body.rotation.toRotationMatrix(), rows);
    problem.attitude(point, i) += rows;
  }
  return problem.point(std::move(point));
}

/// Attitudes of a point, whose further columns are not looked at any more.
template <class Scalar>
std::vector<Eigen::Matrix3d> attitudes_of(const LiftedProblem<Scalar>& problem,
                                          const typename LiftedProblem<Scalar>::Matrix& point) {
  using Problem = LiftedProblem<Scalar>;
  Eigen::Index mirrored = 0;
  if constexpr (!Problem::kPlanar) {
    for (Eigen::Index i = 0; i < problem.poses(); ++i) {
      if (problem.attitude(point, i).template leftCols<3>().determinant() < 0.0) ++mirrored;
    }
  }
  std::vector<Eigen::Matrix3d> attitudes;
  for (Eigen::Index i = 0; i < problem.poses(); ++i) {
    const typename Problem::Matrix rows = problem.attitude(point, i).leftCols(Problem::kRows);
    attitudes.push_back(attitude_in(rows, 2 * mirrored > problem.poses()));
  }
  return attitudes;
}

template <class Scalar>
std::vector<Eigen::Matrix3d> descended(const PoseGraph& graph, const std::vector<KeyframePose>& start,
                                       const std::function<bool()>& goes_on) {
  using Problem = LiftedProblem<Scalar>;
  Problem problem(graph);
  if (!problem.determined()) return {};
  constexpr Patience kPatience = Problem::kPlanar ? kInThePlane : kInSpace;
  TrustedDescent<Scalar> descent(problem, kPatience.flat, goes_on);
  auto point = turned(problem, descent.run(first_point(problem, start)));
  const auto left = [&] {
    const auto rows = static_cast<double>(problem.poses());
    return point.bottomRows(Problem::kRows * problem.poses()).rightCols(kMoreColumns).squaredNorm() / rows;
  };
  for (double share = kFirstPressure; share <= kLastPressure && left() > kPressedOut;
       share *= kPatience.more_pressure) {
    problem.press(share);
    point = descent.run(std::move(point));
  }
  if (!goes_on()) return {};
  return attitudes_of(problem, point);
}

}  // namespace

std::vector<KeyframePose> lifted_start(const PoseGraph& graph, const std::vector<KeyframePose>& start,
                                       const std::function<bool()>& goes_on) {
  if (graph.vertices.size() < 2) return graph.vertices;
  return with_positions(graph, graph.planar ? descended<std::complex<double>>(graph, start, goes_on)
                                            : descended<double>(graph, start, goes_on));
}

}  // namespace ignis
