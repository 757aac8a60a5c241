// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "drivers/sim/imu_model.h"
#include "drivers/sim/lidar_config.h"
#include "drivers/sim/mesh_config.h"
#include "drivers/sim/mover_config.h"
#include "drivers/sim/ray_scene.h"
#include "drivers/sim/solid_config.h"
#include "drivers/sim/trajectory.h"

/// A scene file: geometry, drive and sensor of one simulation. World frame: +X right, +Y up, -Z forward at yaw 0;
/// lengths in metres, floor usually at y = 0.
namespace ignis::sim {

struct SceneConfig {
  std::string description;
  std::string geometry;  ///< file beside this one whose geometry is taken over; empty: none
  std::vector<PlaneConfig> planes;
  std::vector<BoxConfig> boxes;
  std::vector<CylinderConfig> cylinders;
  std::vector<SphereConfig> spheres;
  std::vector<MeshConfig> meshes;
  std::vector<MoverConfig> movers;
  TrajectoryConfig trajectory;
  ImuModelConfig imu;
  LidarConfig lidar;

  void visit_fields(this auto& self, auto& visit) {
    visit.text("description", self.description, "what the scene is for");
    visit.text("geometry", self.geometry, "scene file beside this one whose geometry is taken over");
    visit.list("planes", self.planes, 1000, "unbounded planes");
    visit.list("boxes", self.boxes, 100000, "boxes");
    visit.list("cylinders", self.cylinders, 100000, "cylinders");
    visit.list("spheres", self.spheres, 100000, "spheres");
    visit.list("meshes", self.meshes, 1000, "triangle meshes");
    visit.list("movers", self.movers, 100, "what moves");
    visit.section("trajectory", self.trajectory, "the drive");
    visit.section("imu", self.imu, "errors of the inertial unit");
    visit.section("lidar", self.lidar, "the LiDAR");
  }
};

/// Reads a scene, the meshes and the geometry it names. Throws config::ConfigError that names the file and every
/// offence.
[[nodiscard]] SceneConfig load_scene(const std::filesystem::path& file);

[[nodiscard]] RayScene make_ray_scene(const SceneConfig& scene);

}  // namespace ignis::sim
