// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "common/config_fields.h"
#include "drivers/sim/imu_model.h"
#include "drivers/sim/l1_beam.h"
#include "drivers/sim/ray_scene.h"
#include "drivers/sim/trajectory.h"

/// A scene file: geometry, drive and sensor of one simulation. World frame: +X right, +Y up, -Z forward at yaw 0;
/// lengths in metres, floor usually at y = 0. Reflectivity is the share of light that a surface sends back, 0 to 1.
namespace ignis::sim {

struct PlaneConfig {
  std::string name = {};
  std::array<double, 3> normal = {0.0, 1.0, 0.0};
  double offset_m = 0.0;
  double reflectivity = 0.5;

  void visit_fields(this auto& self, auto& visit) {
    visit.text("name", self.name, "for people");
    visit.vector("normal", self.normal, {-1.0, 1.0}, "1", "direction to the free side; scaled to unit length");
    visit.number("offset_m", self.offset_m, {-1000.0, 1000.0}, "m",
                 "distance of the plane from the origin along normal");
    visit.number("reflectivity", self.reflectivity, {0.0, 1.0}, "1", "share of light sent back");
  }
  void check(config::Offences& offences, const std::string& path) const;
};

struct BoxConfig {
  std::string name = {};
  std::array<double, 3> center_m = {0.0, 0.0, 0.0};
  std::array<double, 3> size_m = {1.0, 1.0, 1.0};
  double yaw_deg = 0.0;
  double pitch_deg = 0.0;
  double reflectivity = 0.5;

  void visit_fields(this auto& self, auto& visit) {
    visit.text("name", self.name, "for people");
    visit.vector("center_m", self.center_m, {-1000.0, 1000.0}, "m", "middle of the box");
    visit.vector("size_m", self.size_m, {0.001, 1000.0}, "m", "full size along the box's own x, y, z");
    visit.number("yaw_deg", self.yaw_deg, {-360.0, 360.0}, "deg", "turn to the left about up");
    visit.number("pitch_deg", self.pitch_deg, {-89.0, 89.0}, "deg", "-z end upward: a ramp that rises going forward");
    visit.number("reflectivity", self.reflectivity, {0.0, 1.0}, "1", "share of light sent back");
  }
};

struct CylinderConfig {
  std::string name = {};
  std::array<double, 3> center_m = {0.0, 0.0, 0.0};
  std::string axis = "y";
  double radius_m = 0.5;
  double length_m = 1.0;
  double reflectivity = 0.5;

  void visit_fields(this auto& self, auto& visit) {
    visit.text("name", self.name, "for people");
    visit.vector("center_m", self.center_m, {-1000.0, 1000.0}, "m", "middle of the axis");
    visit.choice("axis", self.axis, {"x", "y", "z"}, "world axis that the cylinder's axis follows");
    visit.number("radius_m", self.radius_m, {0.001, 100.0}, "m", "radius");
    visit.number("length_m", self.length_m, {0.001, 1000.0}, "m", "end to end");
    visit.number("reflectivity", self.reflectivity, {0.0, 1.0}, "1", "share of light sent back");
  }
};

struct SphereConfig {
  std::string name = {};
  std::array<double, 3> center_m = {0.0, 0.0, 0.0};
  double radius_m = 0.5;
  double reflectivity = 0.5;

  void visit_fields(this auto& self, auto& visit) {
    visit.text("name", self.name, "for people");
    visit.vector("center_m", self.center_m, {-1000.0, 1000.0}, "m", "middle of the sphere");
    visit.number("radius_m", self.radius_m, {0.001, 100.0}, "m", "radius");
    visit.number("reflectivity", self.reflectivity, {0.0, 1.0}, "1", "share of light sent back");
  }
};

struct SceneConfig {
  std::string description;
  std::string geometry;  ///< file beside this one whose solids are taken over; empty: none
  std::vector<PlaneConfig> planes;
  std::vector<BoxConfig> boxes;
  std::vector<CylinderConfig> cylinders;
  std::vector<SphereConfig> spheres;
  TrajectoryConfig trajectory;
  ImuModelConfig imu;
  L1BeamConfig lidar;

  void visit_fields(this auto& self, auto& visit) {
    visit.text("description", self.description, "what the scene is for");
    visit.text("geometry", self.geometry, "scene file beside this one whose solids are taken over");
    visit.list("planes", self.planes, 1000, "unbounded planes");
    visit.list("boxes", self.boxes, 100000, "boxes");
    visit.list("cylinders", self.cylinders, 100000, "cylinders");
    visit.list("spheres", self.spheres, 100000, "spheres");
    visit.section("trajectory", self.trajectory, "the drive");
    visit.section("imu", self.imu, "errors of the inertial unit");
    visit.section("lidar", self.lidar, "the LiDAR");
  }
};

/// Reads a scene and the geometry it names. Throws config::ConfigError that names the file and every offence.
[[nodiscard]] SceneConfig load_scene(const std::filesystem::path& file);

[[nodiscard]] RayScene make_ray_scene(const SceneConfig& scene);

}  // namespace ignis::sim
