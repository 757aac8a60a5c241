// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/lifted_start.h"

#include <gtest/gtest.h>

#include <complex>
#include <random>

#include "backend/pose_graph/lifted_problem.h"
#include "common/so3.h"

namespace ignis {
namespace {

constexpr int kPoses = 60;

double drawn(std::mt19937& random, double sigma) { return std::normal_distribution<double>(0.0, sigma)(random); }

Pose random_pose(std::mt19937& random, bool planar) {
  Pose pose;
  Eigen::Vector3d turn(drawn(random, 2.0), drawn(random, 2.0), drawn(random, 2.0));
  pose.translation = {drawn(random, 5.0), drawn(random, 5.0), drawn(random, 5.0)};
  if (planar) turn.x() = turn.y() = pose.translation.z() = 0.0;
  pose.rotation = so3::exp(turn);
  return pose;
}

/// Poses anywhere, with exact edges to the next one and to some that come later.
PoseGraph exact_graph(bool planar) {
  std::mt19937 random(7);
  PoseGraph graph;
  graph.planar = planar;
  for (int i = 0; i < kPoses; ++i) graph.vertices.push_back({i, random_pose(random, planar)});
  Vector6d information;
  information << 100.0, 100.0, 100.0, 25.0, 25.0, 25.0;
  const auto connect = [&](int from, int to) {
    const Pose& T_map_from = graph.vertices[static_cast<std::size_t>(from)].T_map_body;
    const Pose& T_map_to = graph.vertices[static_cast<std::size_t>(to)].T_map_body;
    graph.edges.push_back({from, to, T_map_from.inverse() * T_map_to, information.asDiagonal(), to > from + 1});
  };
  for (int i = 0; i + 1 < kPoses; ++i) connect(i, i + 1);
  for (int i = 0; i + 9 < kPoses; i += 4) connect(i, i + 9);
  return graph;
}

bool always() { return true; }

class LiftedStart : public ::testing::TestWithParam<bool> {};

TEST_P(LiftedStart, FindsTheTruthOfExactEdgesFromAnywhere) {
  const PoseGraph graph = exact_graph(GetParam());
  std::mt19937 random(8);
  std::vector<KeyframePose> anywhere;
  for (int i = 0; i < kPoses; ++i) anywhere.push_back({i, random_pose(random, GetParam())});
  const std::vector<KeyframePose> found = lifted_start(graph, anywhere, always);
  ASSERT_EQ(found.size(), graph.vertices.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_LT(body_difference(graph.vertices[i].T_map_body, found[i].T_map_body).norm(), 1e-3) << i;
  }
}

TEST_P(LiftedStart, IsEmptyWhereNothingIsSaidOfAnAttitude) {
  PoseGraph graph = exact_graph(GetParam());
  graph.vertices.push_back({kPoses, Pose()});
  Matrix6d information = Matrix6d::Zero();
  information.bottomRightCorner<3, 3>().setIdentity();
  graph.edges.push_back({0, kPoses, Pose(), information, false});
  EXPECT_TRUE(lifted_start(graph, graph.vertices, always).empty());
}

TEST_P(LiftedStart, EndsAtOnceWhenItMayNotGoOn) {
  const PoseGraph graph = exact_graph(GetParam());
  std::mt19937 random(8);
  std::vector<KeyframePose> anywhere;
  for (int i = 0; i < kPoses; ++i) anywhere.push_back({i, random_pose(random, GetParam())});
  int asked = 0;
  EXPECT_TRUE(lifted_start(graph, anywhere, [&] { return ++asked < 10; }).empty());
  EXPECT_LT(asked, 40);
}

INSTANTIATE_TEST_SUITE_P(Either, LiftedStart, ::testing::Bool(),
                         [](const auto& instance) { return instance.param ? "Plane" : "Space"; });

template <class Scalar>
class LiftedProblemOf : public ::testing::Test {
 public:
  using Problem = LiftedProblem<Scalar>;
  using Matrix = typename Problem::Matrix;

  LiftedProblemOf() { problem_.press(0.2); }

  /// Normal deviates, in all parts of a number.
  Matrix random_rows() {
    Matrix rows(problem_.rows(), Problem::kRows + 2);
    for (Scalar& value : rows.reshaped()) {
      value = drawn(random_, 1.0);
      if constexpr (Problem::kPlanar) value += std::complex<double>(0.0, drawn(random_, 1.0));
    }
    return rows;
  }

  std::mt19937 random_{3};
  Problem problem_{exact_graph(Problem::kPlanar)};
};

using Scalars = ::testing::Types<double, std::complex<double>>;
TYPED_TEST_SUITE(LiftedProblemOf, Scalars);

TYPED_TEST(LiftedProblemOf, GradientAndCurvatureAreThoseOfTheCost) {
  using Problem = typename TestFixture::Problem;
  const auto point = this->problem_.point(this->random_rows());
  const auto slope = this->problem_.slope(point);
  // What turns a gradient into a step lies in the tangent space, with the positions along.
  const auto step = this->problem_.free_step(point, this->random_rows());
  const double h = 1e-4 / step.norm();
  const double ahead = this->problem_.cost(this->problem_.point(point + h * step));
  const double behind = this->problem_.cost(this->problem_.point(point - h * step));
  const double here = this->problem_.cost(point);
  const double first = (ahead - behind) / (2.0 * h);
  const double second = (ahead - 2.0 * here + behind) / (h * h);
  EXPECT_NEAR(Problem::dot(slope.gradient, step), first, 1e-5 * std::abs(first));
  EXPECT_NEAR(Problem::dot(step, this->problem_.curvature(point, slope, step)), second, 1e-3 * std::abs(second));
}

/// The graph's own poses, in as many columns as a test's random rows have.
template <class Problem>
typename Problem::Matrix attitudes_of_the_truth(const Problem& problem, const PoseGraph& graph) {
  typename Problem::Matrix rows = Problem::Matrix::Zero(problem.rows(), Problem::kRows + 2);
  for (Eigen::Index i = 0; i < problem.poses(); ++i) {
    const Eigen::Matrix3d R = graph.vertices[static_cast<std::size_t>(i)].T_map_body.rotation.toRotationMatrix();
    if constexpr (Problem::kPlanar) {
      problem.attitude(rows, i)(0, 0) = {R(0, 0), R(1, 0)};
    } else {
      problem.attitude(rows, i).template leftCols<3>() = R.transpose();
    }
  }
  return rows;
}

TYPED_TEST(LiftedProblemOf, TheTruthCostsNothingThoughThereIsPressure) {
  const PoseGraph graph = exact_graph(TestFixture::Problem::kPlanar);
  EXPECT_NEAR(this->problem_.cost(this->problem_.point(attitudes_of_the_truth(this->problem_, graph))), 0.0, 1e-9);
}

TYPED_TEST(LiftedProblemOf, ASmallTurnCostsHalfItsSquareTimesItsInformation) {
  constexpr double kTurn = 1e-3;
  PoseGraph graph = exact_graph(TestFixture::Problem::kPlanar);
  // The newest pose hangs on one edge: its position gives way, its heading is what the edge judges.
  graph.vertices.push_back({kPoses, graph.vertices.back().T_map_body});
  graph.edges.push_back({kPoses - 1, kPoses, Pose(), 100.0 * Matrix6d::Identity(), false});
  const typename TestFixture::Problem problem(graph);
  auto& turned = graph.vertices.back().T_map_body.rotation;
  turned = turned * so3::exp({0.0, 0.0, kTurn});
  const double cost = problem.cost(problem.point(attitudes_of_the_truth(problem, graph)));
  EXPECT_NEAR(cost, 0.5 * 100.0 * kTurn * kTurn, 1e-9);
}

}  // namespace
}  // namespace ignis
