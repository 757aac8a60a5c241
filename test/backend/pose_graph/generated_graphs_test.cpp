// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <new>
#include <numbers>
#include <ostream>
#include <random>
#include <string>

#include "backend/pose_graph/pose_graph_optimiser.h"
#include "common/so3.h"

namespace ignis {
namespace {

/// Truth of a graph, and which poses see each other.
struct Layout {
  std::vector<Pose> poses;
  std::vector<std::pair<std::size_t, std::size_t>> loops;  ///< earlier, later
};

/// A winding around a torus; each pose sees the one a turn before it and one half way back.
Layout torus() {
  constexpr std::size_t kPerTurn = 20;
  constexpr std::size_t kTurns = 25;
  Layout layout;
  for (std::size_t i = 0; i < kPerTurn * kTurns; ++i) {
    const double around = 2.0 * std::numbers::pi * static_cast<double>(i) / kPerTurn;
    const double along = around / kTurns;
    const double radius = 10.0 + 3.0 * std::cos(around);
    Pose pose;
    pose.translation = {radius * std::cos(along), 3.0 * std::sin(around), radius * std::sin(along)};
    pose.rotation = so3::exp(Eigen::Vector3d(0.0, -along, 0.0)) * so3::exp(Eigen::Vector3d(0.0, 0.0, around));
    layout.poses.push_back(pose);
    if (i >= kPerTurn) layout.loops.emplace_back(i - kPerTurn, i);
    if (i >= kPerTurn * kTurns - kPerTurn) layout.loops.emplace_back(i - (kTurns - 1) * kPerTurn, i);
  }
  return layout;
}

/// A random walk along the streets of a city of four storeys; a crossing that is met again is a loop.
Layout city() {
  std::mt19937 random(5);
  Layout layout;
  Eigen::Vector3i cell(0, 0, 0);
  int heading = 0;
  for (std::size_t i = 0; i < 700; ++i) {
    const double yaw = 0.5 * std::numbers::pi * heading;
    Pose pose;
    pose.translation = cell.cast<double>().cwiseProduct(Eigen::Vector3d(2.0, 3.0, 2.0));
    pose.rotation = so3::exp(Eigen::Vector3d(0.0, yaw, 0.0));
    for (std::size_t k = 0; k + 10 < i; ++k) {
      if ((layout.poses[k].translation - pose.translation).norm() > 0.1) continue;
      layout.loops.emplace_back(k, i);
      break;
    }
    layout.poses.push_back(pose);
    const auto draw = random() % 10;
    if (draw < 3) heading = static_cast<int>((heading + (draw == 0 ? 3 : 1)) % 4);
    const Eigen::Vector3d ahead =
        so3::exp(Eigen::Vector3d(0.0, 0.5 * std::numbers::pi * heading, 0.0)) * Eigen::Vector3d(0.0, 0.0, -1.0);
    Eigen::Vector3i next =
        cell + Eigen::Vector3i(static_cast<int>(std::lround(ahead.x())), 0, static_cast<int>(std::lround(ahead.z())));
    if (std::abs(next.x()) > 7 || std::abs(next.z()) > 7) {
      heading = (heading + 2) % 4;
      next = cell;
      next.y() = static_cast<int>(random() % 4);
    }
    cell = next;
  }
  return layout;
}

/// A random walk over the crossings of a plane city, as in the Manhattan world of E. Olson; of those that are met again
/// one in `one_in` is a loop.
Layout manhattan(std::size_t poses, std::size_t one_in) {
  std::mt19937 random(2);
  Layout layout;
  std::size_t met = 0;
  Eigen::Vector2i cell(0, 0);
  int heading = 0;
  for (std::size_t i = 0; i < poses; ++i) {
    Pose pose;
    pose.translation = {static_cast<double>(cell.x()), static_cast<double>(cell.y()), 0.0};
    pose.rotation = so3::exp(Eigen::Vector3d(0.0, 0.0, 0.5 * std::numbers::pi * heading));
    for (std::size_t k = 0; k + 10 < i; ++k) {
      if ((layout.poses[k].translation - pose.translation).norm() > 0.1) continue;
      if (met++ % one_in == 0) layout.loops.emplace_back(k, i);
      break;
    }
    layout.poses.push_back(pose);
    const auto draw = random() % 8;
    if (draw < 2 || cell.cwiseAbs().maxCoeff() > 12) heading = static_cast<int>((heading + (draw == 0 ? 3 : 1)) % 4);
    const Eigen::Vector3d ahead =
        so3::exp(Eigen::Vector3d(0.0, 0.0, 0.5 * std::numbers::pi * heading)) * Eigen::Vector3d::UnitX();
    const Eigen::Vector2i step(static_cast<int>(std::lround(ahead.x())), static_cast<int>(std::lround(ahead.y())));
    if ((cell + step).cwiseAbs().maxCoeff() <= 13) cell += step;
  }
  return layout;
}

Layout manhattan_of_many_loops() { return manhattan(1000, 1); }
Layout manhattan_of_some_loops() { return manhattan(2000, 5); }
Layout manhattan_of_few_loops() { return manhattan(2000, 10); }

struct Generated {
  const char* name;
  Layout (*layout)();
  double sigma_m = 0.05;
  double sigma_rad = 0.01;
  bool planar = false;
};
void PrintTo(const Generated& graph, std::ostream* out) { *out << graph.name; }

/// Noisy edges along the layout; the vertices are the truth.
PoseGraph measured(const Generated& generated, unsigned seed) {
  const Layout layout = generated.layout();
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Vector6d sigmas;
  sigmas << Eigen::Vector3d::Constant(generated.sigma_rad), Eigen::Vector3d::Constant(generated.sigma_m);
  Vector6d moves = Vector6d::Ones();
  if (generated.planar) moves << 0.0, 0.0, 1.0, 1.0, 1.0, 0.0;
  PoseGraph graph;
  graph.planar = generated.planar;
  const auto connect = [&](std::size_t from, std::size_t to, bool is_loop) {
    Vector6d error;
    for (int i = 0; i < 6; ++i) error(i) = moves(i) * sigmas(i) * normal(random);
    const Pose T = perturbed_in_body(layout.poses[from].inverse() * layout.poses[to], error);
    graph.edges.push_back({static_cast<std::int32_t>(from), static_cast<std::int32_t>(to), T,
                           sigmas.cwiseAbs2().cwiseInverse().asDiagonal(), is_loop});
  };
  for (std::size_t i = 0; i < layout.poses.size(); ++i) {
    graph.vertices.push_back({static_cast<std::int32_t>(i), layout.poses[i]});
    if (i > 0) connect(i - 1, i, false);
  }
  for (const auto& [from, to] : layout.loops) connect(from, to, true);
  return graph;
}

SolverConfig config_for_files() {
  SolverConfig config;
  config.relinearize_position_m = config.relinearize_rotation_rad = 0.1;
  config.relinearize_skip = 10;
  config.wildfire_threshold = 1e-3;
  return config;
}

PoseGraph without_poses(PoseGraph graph) {
  for (std::size_t i = 1; i < graph.vertices.size(); ++i) graph.vertices[i].T_map_body = Pose();
  return graph;
}

class GeneratedGraph : public ::testing::TestWithParam<Generated> {};

// Batch LM that begins at the truth cannot be caught in a wrong minimum; the incremental solver never sees the truth.
TEST_P(GeneratedGraph, EndsWithinOnePerMilleOfTheOptimumThatBatchFindsFromTheTruth) {
  const PoseGraph graph = measured(GetParam(), 3);
  ASSERT_GT(graph.edges.size(), graph.vertices.size() + 100);
  const double optimum = optimise_in_batch(graph, [](std::size_t, double) { return true; }).half_chi_square;
  const double freedom = (graph.planar ? 3.0 : 6.0) *
                         (static_cast<double>(graph.edges.size()) - static_cast<double>(graph.vertices.size()) + 1.0);
  EXPECT_NEAR(optimum, 0.5 * freedom, 5.0 * std::sqrt(0.5 * freedom)) << "the noise is not what the edges say";
  const double found = optimise_pose_graph(without_poses(graph), config_for_files()).half_chi_square;
  RecordProperty("optimum", std::to_string(optimum));
  RecordProperty("half_chi_square", std::to_string(found));
  EXPECT_LT(found, 1.001 * optimum);
  EXPECT_GT(found, 0.999 * optimum);
}

// Headings that err by 0.25 rad between few loops lead into a wrong minimum pose by pose, at twice the optimum, and
// into another one from the chordal relaxation. Batch LM from the truth itself need not find the best.
TEST(PoseGraphOptimiser, LeavesTheWrongMinimaOfVagueHeadingsByTheLiftedDescent) {
  const PoseGraph graph = measured({"", manhattan_of_few_loops, 0.1, 0.25, true}, 3);
  const double optimum = optimise_in_batch(graph, [](std::size_t, double) { return true; }).half_chi_square;
  const PoseGraphSolution solution = optimise_pose_graph(without_poses(graph), config_for_files());
  RecordProperty("from_the_truth", std::to_string(optimum));
  RecordProperty("half_chi_square", std::to_string(solution.half_chi_square));
  EXPECT_EQ(solution.start, PoseGraphStart::kLiftedDescent) << words_of(solution.start);
  EXPECT_LT(solution.half_chi_square, 1.001 * optimum);
}

TEST(PoseGraphOptimiser, KeepsWhatItFoundWhenAFurtherStartFails) {
  const PoseGraph graph = without_poses(measured({"", manhattan_of_few_loops, 0.1, 0.25, true}, 3));
  const auto solve_until = [&graph](PoseGraphStart failing) {
    PoseGraphOptimiser optimiser(graph, config_for_files());
    while (!optimiser.complete()) optimiser.add_next();
    return optimiser.finish([failing](PoseGraphStart start) {
      if (start == failing) throw std::bad_alloc();
      return true;
    });
  };
  const PoseGraphSolution first = solve_until(PoseGraphStart::kChordalRelaxation);
  EXPECT_EQ(first.start, PoseGraphStart::kPoseByPose);
  EXPECT_EQ(first.given_up, std::bad_alloc().what());
  EXPECT_EQ(first.poses.size(), graph.vertices.size());
  const PoseGraphSolution second = solve_until(PoseGraphStart::kLiftedDescent);
  EXPECT_EQ(second.start, PoseGraphStart::kChordalRelaxation);
  EXPECT_EQ(second.given_up, std::bad_alloc().what());
  EXPECT_LT(second.half_chi_square, first.half_chi_square);
  EXPECT_EQ(solve_until(PoseGraphStart::kStoredPoses).given_up, "");
}

INSTANTIATE_TEST_SUITE_P(Seeded, GeneratedGraph,
                         ::testing::Values(Generated{"torus", torus}, Generated{"city", city},
                                           Generated{"manhattan", manhattan_of_many_loops, 0.05, 0.02, true},
                                           // As in the variants of the Manhattan world by L. Carlone.
                                           Generated{"manhattanOfVagueHeadings", manhattan_of_some_loops, 0.1, 0.25,
                                                     true}),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace ignis
