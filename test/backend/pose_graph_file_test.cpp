// SPDX-License-Identifier: Apache-2.0
#include "backend/pose_graph_file.h"

#include <gtest/gtest.h>

#include <fstream>
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
    PoseGraphEdge edge{3 * (i - 1), 3 * i, pose(), Matrix6d::Zero(), i == 4};
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) {
        edge.information(row, column) = edge.information(column, row) = normal(random);
      }
    }
    graph.edges.push_back(edge);
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

TEST_F(PoseGraphFile, NamesFileLineAndReason) {
  EXPECT_TRUE(contains(complaint(), "cannot be opened"));
  write_text("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 0 0 nan 0 0 0 1\n");
  EXPECT_TRUE(contains(complaint(), ":2:"));
  EXPECT_TRUE(contains(complaint(), "finite number"));
  write_text("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 0\n");
  EXPECT_TRUE(contains(complaint(), "unit length"));
  write_text("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n");
  EXPECT_TRUE(contains(complaint(), "twice"));
  write_text("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nEDGE_SE3:QUAT 0 7 0 0 0 0 0 0 1\n");
  EXPECT_TRUE(contains(complaint(), "unknown vertex"));
  write_text("VERTEX_SE2 0 0 0 0\n");
  EXPECT_TRUE(contains(complaint(), "VERTEX_SE2"));
}

}  // namespace
}  // namespace ignis
