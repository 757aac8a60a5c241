// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <ostream>

#include "backend/pose_graph_optimiser.h"
#include "backend/recorded_data.h"

namespace ignis {
namespace {

/// A published graph and half its chi-square at the known optimum.
struct Published {
  const char* name;
  double optimum;
};
void PrintTo(const Published& graph, std::ostream* out) { *out << graph.name; }

class PublishedGraph : public ::testing::TestWithParam<Published> {};

TEST_P(PublishedGraph, EndsWithinOnePerMilleOfTheOptimum) {
  const auto file =
      testing::recorded_data(std::filesystem::path("posegraphs") / (std::string(GetParam().name) + ".g2o"));
  IGNIS_REQUIRE_DATA(file);
  SolverConfig config;
  // Thousands of poses that all move would otherwise be linearised anew at every step.
  config.relinearize_position_m = config.relinearize_rotation_rad = 0.1;
  config.relinearize_skip = 10;
  const PoseGraphSolution solution = optimise_pose_graph(read_pose_graph(file), config);
  RecordProperty("half_chi_square", std::to_string(solution.half_chi_square));
  EXPECT_LT(solution.half_chi_square, 1.001 * GetParam().optimum);
  EXPECT_GT(solution.half_chi_square, 0.999 * GetParam().optimum);
}

INSTANTIATE_TEST_SUITE_P(Recorded, PublishedGraph,
                         ::testing::Values(Published{"smallGrid3D", 517.925332}, Published{"sphere2500", 675.700963},
                                           Published{"parking-garage", 0.634192401}),
                         [](const auto& instance) {
                           std::string name = instance.param.name;
                           std::erase(name, '-');
                           return name;
                         });

TEST(PoseGraphOptimiser, RefusesAPoseThatHangsInTheAir) {
  PoseGraph graph;
  graph.vertices = {{0, {}}, {1, {}}};
  EXPECT_THROW(static_cast<void>(optimise_pose_graph(graph, SolverConfig())), std::runtime_error);
}

TEST(PoseGraphOptimiser, FollowsAnEdgeAgainstItsDirection) {
  Pose step;
  step.translation = {1.0, 2.0, 3.0};
  step.rotation = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ());
  PoseGraph graph;
  graph.vertices = {{5, {}}, {9, {}}};
  graph.edges = {{9, 5, step.inverse(), Matrix6d::Identity(), false}};
  const PoseGraphSolution solution = optimise_pose_graph(graph, SolverConfig());
  ASSERT_EQ(solution.poses.size(), 2U);
  EXPECT_LT(body_difference(step, solution.poses[1].T_map_body).norm(), 1e-9);
  EXPECT_NEAR(solution.half_chi_square, 0.0, 1e-12);
}

}  // namespace
}  // namespace ignis
