// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include <gtest/gtest.h>

#include "common/frames.h"
#include "drivers/sim/scene_config.h"

namespace ignis::sim {
namespace {

std::filesystem::path scene_folder() { return std::filesystem::path(IGNIS_CONFIG_DIR) / "scenes"; }

class ShippedScenes : public ::testing::TestWithParam<std::string> {};

TEST_P(ShippedScenes, RestFirstAndKeepClearOfAllGeometry) {
  const SceneConfig scene = load_scene(scene_folder() / GetParam());
  const Trajectory drive(scene.trajectory);
  const RayScene geometry = make_ray_scene(scene);
  constexpr double kLeastClearance = 0.4;
  for (double t = 0.0; t < drive.duration(); t += 0.05) {
    const Motion motion = drive.at(t);
    if (t < 4.0) {
      ASSERT_EQ(motion.v_world.norm(), 0.0) << t;
    }
    const Eigen::Vector3d& p = motion.T_world_body.translation;
    ASSERT_GE(geometry.clearance(p), kLeastClearance) << "t = " << t << " at " << p.transpose();
    // The head rides about 0.6 m above whatever carries the vehicle.
    const std::optional<Hit> ground = geometry.cast({p, -Eigen::Vector3d::UnitY()}, 5.0);
    ASSERT_TRUE(ground);
    ASSERT_NEAR(ground->distance, 0.6, 0.12) << "t = " << t << " at " << p.transpose();
  }
}

TEST_P(ShippedScenes, CanBeDrivenByARealVehicle) {
  const SceneConfig scene = load_scene(scene_folder() / GetParam());
  const Trajectory drive(scene.trajectory);
  for (double t = 0.0; t < drive.duration(); t += 0.05) {
    const Motion motion = drive.at(t);
    ASSERT_LT(motion.rate_body.norm(), 1.6) << t;
    ASSERT_LT(motion.a_world.norm(), 2.0) << t;
  }
}

std::vector<std::string> shipped_scenes() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(scene_folder())) {
    names.push_back(entry.path().filename().string());
  }
  std::ranges::sort(names);
  return names;
}

INSTANTIATE_TEST_SUITE_P(All, ShippedScenes, ::testing::ValuesIn(shipped_scenes()),
                         [](const auto& scene) { return std::filesystem::path(scene.param).stem().string(); });

struct HallDrive {
  std::string file;
  double shortest_s;
  double longest_s;
};

class HallDrives : public ::testing::TestWithParam<HallDrive> {};

/// A loop closer that keeps a keyframe every 4 m needs the start again, with the same heading, after at least ten.
TEST_P(HallDrives, ComeBackOverTheirStartWithTheSameHeading) {
  const SceneConfig scene = load_scene(scene_folder() / GetParam().file);
  const Trajectory drive(scene.trajectory);
  EXPECT_GE(drive.duration(), GetParam().shortest_s);
  EXPECT_LE(drive.duration(), GetParam().longest_s);
  EXPECT_GE(drive.length(), 55.0);

  const Motion start = drive.at(0.0);
  double nearest = 1e9;
  double along_at_nearest = 0.0;
  double driven = 0.0;
  for (double t = 0.1; t < drive.duration(); t += 0.1) {
    const Motion motion = drive.at(t);
    driven += 0.1 * motion.v_world.norm();
    const double turn = motion.T_world_body.rotation.angularDistance(start.T_world_body.rotation);
    const double distance = (motion.T_world_body.translation - start.T_world_body.translation).norm();
    if (driven < 44.0 || turn > 0.3 || distance > nearest) continue;
    nearest = distance;
    along_at_nearest = driven;
  }
  EXPECT_LT(nearest, 1.5);
  EXPECT_GE(driven - along_at_nearest, 5.0);
}

INSTANTIATE_TEST_SUITE_P(All, HallDrives,
                         ::testing::Values(HallDrive{"battery_hall.json", 190.0, 230.0},
                                           HallDrive{"battery_hall_quick.json", 50.0, 65.0}),
                         [](const auto& scene) { return std::filesystem::path(scene.param.file).stem().string(); });

}  // namespace
}  // namespace ignis::sim
