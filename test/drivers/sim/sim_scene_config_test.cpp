// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/scene_config.h"

#include <fstream>

#include <gtest/gtest.h>

#include "common/config_check.h"

namespace ignis::sim {
namespace {

class SceneFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              (std::string("ignis_scene_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  static std::string error_of(const std::filesystem::path& file) {
    try {
      (void)load_scene(file);
    } catch (const config::ConfigError& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path folder_;
};

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
