// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph/pose_graph_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <numbers>
#include <random>
#include <sstream>

#include "backend/text_contains.h"
#include "common/so3.h"

namespace ignis {
namespace {

using testing::contains;

class PoseGraphFile : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    file_ = std::filesystem::path(::testing::TempDir()) / (std::string("ignis_") + info->name() + ".g2o");
  }
  void TearDown() override { std::filesystem::remove(file_); }

  void write_text(const std::string& text) const { std::ofstream(file_) << text; }
  std::string complaint() const {
    try {
      static_cast<void>(read_pose_graph(file_));
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "no complaint";
  }

  std::filesystem::path file_;
};

PoseGraph random_graph() {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  const auto pose = [&] {
    const Eigen::Vector3d phi(normal(random), normal(random), normal(random));
    return Pose{so3::exp(phi), {normal(random), normal(random), normal(random)}};
  };
  PoseGraph graph;
  for (int i = 0; i < 6; ++i) graph.vertices.push_back({3 * i, pose()});
  for (int i = 1; i < 6; ++i) {
    Matrix6d root;
    for (double& number : root.reshaped()) number = normal(random);
    graph.edges.push_back({3 * (i - 1), 3 * i, pose(), root.transpose() * root, i == 4});
  }
  return graph;
}

TEST_F(PoseGraphFile, ReadsBackWhatItWrote) {
  const PoseGraph graph = random_graph();
  write_pose_graph(file_, graph);
  const PoseGraph back = read_pose_graph(file_);
  ASSERT_EQ(back.vertices.size(), graph.vertices.size());
  for (std::size_t i = 0; i < graph.vertices.size(); ++i) {
    EXPECT_EQ(back.vertices[i].id, graph.vertices[i].id);
    EXPECT_EQ(back.vertices[i].T_map_body.translation, graph.vertices[i].T_map_body.translation);
    EXPECT_LT(body_difference(back.vertices[i].T_map_body, graph.vertices[i].T_map_body).norm(), 1e-14);
  }
  ASSERT_EQ(back.edges.size(), graph.edges.size());
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    EXPECT_EQ(back.edges[i].from, graph.edges[i].from);
    EXPECT_EQ(back.edges[i].to, graph.edges[i].to);
    EXPECT_EQ(back.edges[i].is_loop, graph.edges[i].is_loop);
    EXPECT_EQ(back.edges[i].information, graph.edges[i].information);
    EXPECT_EQ(back.edges[i].T_from_to.translation, graph.edges[i].T_from_to.translation);
  }
}

TEST_F(PoseGraphFile, WritesTranslationFirstAndFixesTheFirstVertex) {
  PoseGraph graph;
  graph.vertices = {{0, {}}, {1, {Eigen::Quaterniond::Identity(), {1.0, 2.0, 3.0}}}};
  Vector6d diagonal;
  diagonal << 4.0, 5.0, 6.0, 1.0, 2.0, 3.0;
  graph.edges = {{0, 1, graph.vertices[1].T_map_body, diagonal.asDiagonal(), true}};
  write_pose_graph(file_, graph);
  std::stringstream text;
  text << std::ifstream(file_).rdbuf();
  EXPECT_EQ(text.str(),
            "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 2 3 0 0 0 1\nFIX 0\n# loop\n"
            "EDGE_SE3:QUAT 0 1 1 2 3 0 0 0 1 1 0 0 0 0 0 2 0 0 0 0 3 0 0 0 4 0 0 5 0 6\n");
}

TEST_F(PoseGraphFile, ReadsPlanarRecordsInAnyOrderAndWritesThemBack) {
  write_text("EDGE_SE2 4 9 1 2 0.5 10 1 2 20 3 30\nVERTEX_SE2 4 0 0 0\nVERTEX_SE2 9 1 2 0.5\n");
  const PoseGraph graph = read_pose_graph(file_);
  ASSERT_TRUE(graph.planar);
  ASSERT_EQ(graph.edges.size(), 1U);
  const PoseGraphEdge& edge = graph.edges[0];
  EXPECT_EQ(edge.T_from_to.translation, Eigen::Vector3d(1.0, 2.0, 0.0));
  EXPECT_NEAR(so3::log(edge.T_from_to.rotation).z(), 0.5, 1e-15);
  EXPECT_EQ(edge.information(3, 3), 10.0);  // x
  EXPECT_EQ(edge.information(3, 4), 1.0);   // x, y
  EXPECT_EQ(edge.information(3, 2), 2.0);   // x, heading
  EXPECT_EQ(edge.information(2, 2), 30.0);  // heading
  EXPECT_EQ(edge.information(5, 5), 30.0);  // z, which SE2 does not know
  write_pose_graph(file_, graph);
  const PoseGraph back = read_pose_graph(file_);
  EXPECT_TRUE(back.planar);
  EXPECT_EQ(back.edges[0].information, edge.information);
  EXPECT_LT(body_difference(back.vertices[1].T_map_body, graph.vertices[1].T_map_body).norm(), 1e-12);
}

TEST_F(PoseGraphFile, PlacesVerticesThatOnlyEdgesNameAlongTheEdges) {
  // 7 is met first from behind, and an edge that points back leads on to 3.
  write_text("EDGE_SE2 7 5 1 0 1.5707963267948966 1 0 0 1 0 1\nEDGE_SE2 3 7 0 2 0 1 0 0 1 0 1\n");
  const PoseGraph graph = read_pose_graph(file_);
  ASSERT_EQ(graph.vertices.size(), 3U);
  EXPECT_EQ(graph.vertices[0].id, 3);
  EXPECT_EQ(graph.vertices[1].id, 5);
  EXPECT_EQ(graph.vertices[2].id, 7);
  EXPECT_LT(body_difference(graph.vertices[0].T_map_body, Pose()).norm(), 1e-12);
  EXPECT_LT((graph.vertices[2].T_map_body.translation - Eigen::Vector3d(0.0, 2.0, 0.0)).norm(), 1e-12);
  EXPECT_LT((graph.vertices[1].T_map_body.translation - Eigen::Vector3d(1.0, 2.0, 0.0)).norm(), 1e-12);
  EXPECT_NEAR(so3::log(graph.vertices[1].T_map_body.rotation).z(), 0.5 * std::numbers::pi, 1e-12);
}

TEST_F(PoseGraphFile, ReadsWhatOtherToolsAndSystemsAddToIt) {
  write_text(
      "\xEF\xBB\xBF# written elsewhere\r\n#EDGE_SE3:QUAT 4 2 left out\r\n\r\nPARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\r\n"
      "VERTEX_SE3:QUAT 4 0 0 0 0 0 0 1 \r\n\tVERTEX_SE3:QUAT  2 1E+00 -2.5e-1 +3 0 0 0.70711 -0.70711\r\nFIX 4\r\n"
      "EDGE_SE3:QUAT 4 2 1 0 0 0 0 0 -1 1e6 0 0 0 0 0 1e6 0 0 0 0 1e-9 0 0 0 4e4 0 0 4e4 0 4e4\r\n");
  const PoseGraph graph = read_pose_graph(file_);
  ASSERT_EQ(graph.vertices.size(), 2U);
  EXPECT_EQ(graph.vertices[1].T_map_body.translation, Eigen::Vector3d(1.0, -0.25, 3.0));
  EXPECT_NEAR(so3::log(graph.vertices[1].T_map_body.rotation).z(), -0.5 * std::numbers::pi, 1e-12);
  ASSERT_EQ(graph.edges.size(), 1U);
  EXPECT_NEAR(so3::log(graph.edges[0].T_from_to.rotation).norm(), 0.0, 1e-12);
  EXPECT_EQ(graph.edges[0].information(5, 5), 1e-9);
}

TEST_F(PoseGraphFile, NamesFileLineAndReason) {
  EXPECT_TRUE(contains(complaint(), "cannot be opened"));
  write_text("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 0 0 nan 0 0 0 1\n");
  EXPECT_TRUE(contains(complaint(), ":2:"));
  EXPECT_TRUE(contains(complaint(), "finite number"));
  write_text("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 0\n");
  EXPECT_TRUE(contains(complaint(), "unit length"));
  write_text("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n");
  EXPECT_TRUE(contains(complaint(), "twice"));
  write_text(
      "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nEDGE_SE3:QUAT 0 7 0 0 0 0 0 0 1 "
      "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n");
  EXPECT_TRUE(contains(complaint(), ":2: the edge names an unknown vertex, 7"));
  write_text("VERTEX_SE2 6989586621679009792 0 0 0\n");
  EXPECT_TRUE(contains(complaint(), ":1: a whole number of 32 bits is missing"));
  write_text("VERTEX_XY 0 0 0\n");
  EXPECT_TRUE(contains(complaint(), "VERTEX_XY"));
  write_text("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE2 1 0 0 0\n");
  EXPECT_TRUE(contains(complaint(), ":2: SE2 and SE3 records are mixed"));
  write_text("VERTEX_SE2 0 0 0 0 0\n");
  EXPECT_TRUE(contains(complaint(), "too long"));
  write_text("VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 0 1 0 0 1 0 0 1 0 1\n");
  EXPECT_TRUE(contains(complaint(), "to itself"));
  write_text("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 0 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 -1 0 1\n");
  EXPECT_TRUE(contains(complaint(), ":3: the information has a negative direction"));
}

}  // namespace
}  // namespace ignis
