// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <numbers>

#include <gtest/gtest.h>

#include "common/frames.h"
#include "drivers/sim/scene_config.h"
#include "drivers/sim/shipped_scenes.h"
#include "drivers/sim/surface_return.h"

namespace ignis::sim {
namespace {

using test::scene_folder;

/// The beams of a turn of a spinning LiDAR that stands level over the body origin, thinned out.
std::vector<Ray> turn(const SpinningConfig& lidar, const Motion& motion) {
  const Eigen::Matrix3d R_world_lidar =
      (motion.T_world_body.rotation * frames::q_body_from_forward_left_up()).toRotationMatrix();
  std::vector<Ray> rays;
  for (int column = 0; column < lidar.columns; column += 16) {
    const Eigen::AngleAxisd turned(column_azimuth(lidar, column), Eigen::Vector3d::UnitZ());
    for (const Eigen::Vector3d& direction : column_directions(lidar)) {
      rays.push_back({motion.T_world_body.translation, R_world_lidar * (turned * direction)});
    }
  }
  return rays;
}

/// The L1's hemisphere, leaning 45 degrees forward, at an instant of the drive.
std::vector<Ray> hemisphere(const Motion& motion) {
  const Eigen::Vector3d axis_body(0.0, std::numbers::sqrt2 / 2.0, -std::numbers::sqrt2 / 2.0);
  std::vector<Ray> rays;
  // A Fibonacci lattice: even over the sphere.
  constexpr int kPoints = 800;
  for (int i = 0; i < kPoints; ++i) {
    const double y = 1.0 - 2.0 * (i + 0.5) / kPoints;
    const double around = std::numbers::pi * (3.0 - std::sqrt(5.0)) * i;
    const double radius = std::sqrt(1.0 - y * y);
    const Eigen::Vector3d direction(radius * std::cos(around), y, radius * std::sin(around));
    if (direction.dot(axis_body) < 0.0) continue;
    rays.push_back({motion.T_world_body.translation, motion.T_world_body.rotation * direction});
  }
  return rays;
}

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
    ASSERT_GE(geometry.clearance(p, t), kLeastClearance) << "t = " << t << " at " << p.transpose();
    // The head rides about 0.6 m above whatever carries the vehicle.
    const std::optional<Hit> ground = geometry.cast({p, -Eigen::Vector3d::UnitY()}, 5.0, t);
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

TEST_P(ShippedScenes, ShowTheSensorSomethingAllTheTime) {
  const SceneConfig scene = load_scene(scene_folder() / GetParam());
  const Trajectory drive(scene.trajectory);
  const RayScene geometry = make_ray_scene(scene);
  const SpinningConfig& spinning = scene.lidar.spinning;
  const bool spins = scene.lidar.is_spinning();
  const double limit = spins ? spinning.max_range_m : 21.0;
  const double at_10_percent = spins ? spinning.range_at_10_percent_m : scene.lidar.l1.range_at_10_percent_m;
  const double at_90_percent = spins ? spinning.range_at_90_percent_m : scene.lidar.l1.range_at_90_percent_m;
  for (double t = 0.0; t < drive.duration(); t += 1.0) {
    int returns = 0;
    const std::vector<Ray> rays = spins ? turn(spinning, drive.at(t)) : hemisphere(drive.at(t));
    for (const Ray& ray : rays) {
      const std::optional<Hit> hit = geometry.cast(ray, limit, t);
      if (!hit) continue;
      const double brightness = hit->reflectivity * std::abs(hit->normal.dot(ray.direction));
      returns += hit->distance <= visible_range(at_10_percent, at_90_percent, brightness) ? 1 : 0;
    }
    ASSERT_GT(returns, 0.5 * static_cast<double>(rays.size())) << t;
  }
}

TEST_P(ShippedScenes, MoveNothingThroughWhatStands) {
  SceneConfig scene = load_scene(scene_folder() / GetParam());
  std::vector<Mover> movers;
  for (const MoverConfig& mover : scene.movers) movers.push_back(to_mover(mover));
  scene.movers.clear();
  const RayScene standing = make_ray_scene(scene);
  for (std::size_t i = 0; i < movers.size(); ++i) {
    for (double t = 0.0; t < 120.0; t += 0.1) {
      const Eigen::Vector3d waist = movers[i].T_world_mover(t).translation + Eigen::Vector3d::UnitY();
      ASSERT_GT(standing.clearance(waist), 0.5) << "movers[" << i << "] at " << t << " s, " << waist.transpose();
      for (std::size_t k = 0; k < i; ++k) {
        ASSERT_GT(movers[k].clearance(waist, t), 0.5) << "movers[" << i << "] meets movers[" << k << "] at " << t;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedScenes, ::testing::ValuesIn(test::shipped_scenes()), test::kSceneName);

TEST(OpenHallBare, ShowsOnlyFloorCeilingAndRamp) {
  const SceneConfig scene = load_scene(scene_folder() / "open_hall_bare.json");
  EXPECT_EQ(scene.planes.size(), 2U);
  EXPECT_TRUE(scene.cylinders.empty() && scene.spheres.empty() && scene.meshes.empty() && scene.movers.empty());
  for (const BoxConfig& box : scene.boxes) EXPECT_TRUE(box.name.starts_with("ramp")) << box.name;
  const Trajectory drive(scene.trajectory);
  double highest = 0.0;
  for (double t = 0.0; t < drive.duration(); t += 0.1) {
    highest = std::max(highest, drive.at(t).T_world_body.translation.y());
  }
  EXPECT_GT(highest, 1.5) << "the drive goes over the ramp";
}

TEST(CorridorBare, LooksTheSameFromEverywhere) {
  const SceneConfig scene = load_scene(scene_folder() / "corridor_bare.json");
  const Trajectory drive(scene.trajectory);
  const RayScene geometry = make_ray_scene(scene);
  EXPECT_GT(drive.length(), 30.0);
  const Motion start = drive.at(0.0);
  for (double t = 0.0; t < drive.duration(); t += 1.0) {
    const Eigen::Vector3d along = drive.at(t).T_world_body.translation - start.T_world_body.translation;
    EXPECT_NEAR(std::hypot(along.x(), along.y()), 0.0, 0.05);
    for (Ray ray : hemisphere(start)) {
      const std::optional<Hit> there = geometry.cast(ray, 21.0);
      ray.origin.z() += along.z();
      const std::optional<Hit> here = geometry.cast(ray, 21.0);
      ASSERT_EQ(here.has_value(), there.has_value());
      if (here) {
        ASSERT_NEAR(here->distance, there->distance, 1e-9);
      }
    }
  }
}

TEST(IdenticalRooms, LookTheSameFromTheSamePlaceInEach) {
  const RayScene geometry = make_ray_scene(load_scene(scene_folder() / "identical_rooms.json"));
  const Eigen::Vector3d next_room(0.0, 0.0, -10.0);
  for (const Eigen::Vector3d& place : {Eigen::Vector3d(2.0, 0.6, -1.5), {-2.0, 0.6, 1.0}, {0.0, 0.6, -2.5}}) {
    Motion motion;
    motion.T_world_body.translation = place;
    for (Ray ray : hemisphere(motion)) {
      const std::optional<Hit> first = geometry.cast(ray, 21.0);
      ray.origin += next_room;
      const std::optional<Hit> second = geometry.cast(ray, 21.0);
      ASSERT_EQ(first.has_value(), second.has_value());
      if (first) {
        ASSERT_NEAR(first->distance, second->distance, 1e-9);
      }
    }
  }
}

TEST(Warehouse, IsLongAndComesByTheSamePlacesInBothDirections) {
  const SceneConfig scene = load_scene(scene_folder() / "warehouse.json");
  const Trajectory drive(scene.trajectory);
  EXPECT_GE(drive.duration(), 1200.0);
  // Passes through the middle of each aisle, counted by direction along Z.
  std::map<int, std::array<int, 2>> passes;
  double last_z = drive.at(0.0).T_world_body.translation.z();
  for (double t = 0.0; t < drive.duration(); t += 0.2) {
    const Motion motion = drive.at(t);
    const Eigen::Vector3d& p = motion.T_world_body.translation;
    const bool crossed = (last_z < -6.0) != (p.z() < -6.0);
    last_z = p.z();
    if (crossed) ++passes[static_cast<int>(std::lround(p.x()))][motion.v_world.z() < 0.0 ? 0 : 1];
  }
  int both_ways = 0;
  for (const auto& [x, count] : passes) both_ways += count[0] >= 2 && count[1] >= 2 ? 1 : 0;
  EXPECT_EQ(both_ways, 8);
}

TEST(HallWithForklifts, ShowsEachMoverAndItsAbsence) {
  const SceneConfig scene = load_scene(scene_folder() / "hall_with_forklifts.json");
  SceneConfig empty = scene;
  empty.movers.clear();
  const RayScene moving = make_ray_scene(scene);
  const RayScene standing = make_ray_scene(empty);
  const Trajectory drive(scene.trajectory);
  int seconds_with = 0;
  int seconds_without = 0;
  for (double t = 0.0; t < drive.duration(); t += 1.0) {
    int different = 0;
    for (const Ray& ray : hemisphere(drive.at(t))) {
      const std::optional<Hit> with = moving.cast(ray, 15.0, t);
      const std::optional<Hit> without = standing.cast(ray, 15.0, t);
      different += with && (!without || with->distance < without->distance) ? 1 : 0;
    }
    ++(different > 0 ? seconds_with : seconds_without);
  }
  EXPECT_GT(seconds_with, 20);
  EXPECT_GT(seconds_without, 5);
}

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
