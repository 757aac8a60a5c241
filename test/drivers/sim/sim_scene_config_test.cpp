// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/scene_config.h"

#include <gtest/gtest.h>

#include "drivers/sim/scene_files.h"

namespace ignis::sim {
namespace {

using SceneFiles = test::SceneFolder;

TEST_F(SceneFiles, NameEveryOffenceAndTheFile) {
  const std::string error = error_of(write("bad.json", R"({"boxes": [{"size_m": [0, 1, 1], "colour": "red"}],
      "planes": [{"normal": [0, 0, 0]}], "cylinders": [{"axis": "w"}], "spehres": []})"));
  for (const char* expected :
       {"bad.json", "boxes[0].size_m", "colour", "planes[0].normal", "cylinders[0].axis", "spehres"}) {
    EXPECT_NE(error.find(expected), std::string::npos) << expected << " in: " << error;
  }
}

TEST_F(SceneFiles, MissingFileIsAnErrorWithItsName) {
  EXPECT_NE(error_of(folder_ / "nowhere.json").find("nowhere.json"), std::string::npos);
}

TEST_F(SceneFiles, TakeGeometryOverFromTheFileTheyName) {
  write("hall.json", R"({"planes": [{}], "boxes": [{"center_m": [1, 2, 3]}], "spheres": [{}], "cylinders": [{}]})");
  const SceneConfig scene = load_scene(write("drive.json", R"({"geometry": "hall.json", "boxes": [{}]})"));
  EXPECT_EQ(scene.planes.size(), 1U);
  EXPECT_EQ(scene.boxes.size(), 2U);
  EXPECT_EQ(scene.boxes[1].center_m[2], 3.0);
  EXPECT_EQ(scene.cylinders.size(), 1U);
  EXPECT_EQ(scene.spheres.size(), 1U);
}

TEST_F(SceneFiles, RefuseGeometryOfGeometry) {
  write("a.json", R"({"geometry": "b.json"})");
  EXPECT_NE(error_of(write("c.json", R"({"geometry": "a.json"})")).find("b.json"), std::string::npos);
}

TEST_F(SceneFiles, RefuseRepetitionsThatCannotBeMeant) {
  const std::string error = error_of(write("bad.json", R"({"boxes": [
      {"repeat": {"count": [2.5, 1, 1], "step_m": [1, 0, 0]}}, {"repeat": {"count": [1, 3, 1]}},
      {"repeat": {"count": [1000, 1000, 1], "step_m": [1, 1, 0]}}, {"repeat": {"count": [0, 1, 1]}}]})"));
  for (const char* expected : {"boxes[0].repeat.count", "boxes[1].repeat.step_m[1]", "boxes[2].repeat.count",
                               "100000 copies", "boxes[3].repeat.count"}) {
    EXPECT_NE(error.find(expected), std::string::npos) << expected << " in: " << error;
  }
}

TEST_F(SceneFiles, RefuseMoversThatCannotMove) {
  const std::string error = error_of(write("bad.json", R"({"movers": [
      {"boxes": [{}]}, {"waypoints": [{}]}, {"boxes": [{}], "waypoints": [{}, {}]},
      {"boxes": [{}], "waypoints": [{}, {"position_m": [1, 0, 0]}, {}]}]})"));
  for (const char* expected : {"movers[0].waypoints", "movers[1] = no solids", "movers[2].waypoints[1].position_m",
                               "movers[3].waypoints[0].position_m"}) {
    EXPECT_NE(error.find(expected), std::string::npos) << expected << " in: " << error;
  }
}

TEST(MakeRayScene, RepeatsSolidsAtTheirSteps) {
  SceneConfig config;
  config.boxes.push_back(
      {.center_m = {0, 5, 0}, .size_m = {0.2, 0.2, 0.2}, .repeat = {.count = {3, 1, 2}, .step_m = {2, 0, -4}}});
  config.cylinders.push_back(
      {.center_m = {0, -5, 0}, .radius_m = 0.1, .length_m = 0.2, .repeat = {.count = {1, 2, 1}, .step_m = {0, -3, 0}}});
  const RayScene scene = make_ray_scene(config);
  EXPECT_EQ(scene.solids().size(), 8U);
  for (const Eigen::Vector3d& inside : std::vector<Eigen::Vector3d>{
           {0, 5, 0}, {2, 5, 0}, {4, 5, 0}, {0, 5, -4}, {2, 5, -4}, {4, 5, -4}, {0, -5, 0}, {0, -8, 0}}) {
    EXPECT_NEAR(scene.clearance(inside), -0.1, 1e-12) << inside.transpose();
  }
}

TEST(MakeRayScene, LaysCylindersAlongTheirAxis) {
  for (const auto& [axis, end] : {std::pair{"x", Eigen::Vector3d(4, 0, 0)}, std::pair{"y", Eigen::Vector3d(0, 4, 0)},
                                  std::pair{"z", Eigen::Vector3d(0, 0, 4)}}) {
    SceneConfig config;
    config.cylinders.push_back({.axis = axis, .radius_m = 0.5, .length_m = 10.0});
    const RayScene scene = make_ray_scene(config);
    EXPECT_NEAR(scene.clearance(end), -0.5, 1e-12) << axis;
    EXPECT_NEAR(scene.clearance(1.5 * end), 1.0, 1e-12) << axis;
    EXPECT_NEAR(scene.solids()[0].R_world_local.determinant(), 1.0, 1e-12);
  }
}

TEST(MakeRayScene, TurnsBoxesByYawLeftAndPitchNoseUp) {
  SceneConfig config;
  config.boxes.push_back({.size_m = {1, 0.2, 10}, .yaw_deg = 90.0, .pitch_deg = 30.0});
  const RayScene scene = make_ray_scene(config);
  // Forward (-Z) turned left is -X; its far end is raised.
  EXPECT_LT(scene.clearance({-4 * std::sqrt(0.75), 2.0, 0}), 0.0);
  EXPECT_GT(scene.clearance({-4 * std::sqrt(0.75), -2.0, 0}), 1.0);
}

TEST(MakeRayScene, ScalesPlaneNormalsToUnitLength) {
  SceneConfig config;
  config.planes.push_back({.normal = {0.0, 0.5, 0.0}, .offset_m = 1.0});
  EXPECT_DOUBLE_EQ(make_ray_scene(config).clearance({0, 3, 0}), 2.0);
}

}  // namespace
}  // namespace ignis::sim
