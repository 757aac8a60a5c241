// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "common/config_fields.h"
#include "drivers/sim/solids.h"

/// Planes and solids as a scene file describes them. Reflectivity is the share of light that a surface sends back.
namespace ignis::sim {

/// Copies of a solid at equal steps, such as the uprights of a rack.
struct RepeatConfig {
  std::array<double, 3> count = {1.0, 1.0, 1.0};
  std::array<double, 3> step_m = {0.0, 0.0, 0.0};

  void visit_fields(this auto& self, auto& visit) {
    visit.vector("count", self.count, {1.0, 1000.0}, "1", "copies along the world's x, y, z, the first one included");
    visit.vector("step_m", self.step_m, {-1000.0, 1000.0}, "m", "from one copy to the next along x, y, z");
  }
  void check(config::Offences& offences, const std::string& path) const;
};

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
  RepeatConfig repeat = {};

  void visit_fields(this auto& self, auto& visit) {
    visit.text("name", self.name, "for people");
    visit.vector("center_m", self.center_m, {-1000.0, 1000.0}, "m", "middle of the box");
    visit.vector("size_m", self.size_m, {0.001, 1000.0}, "m", "full size along the box's own x, y, z");
    visit.number("yaw_deg", self.yaw_deg, {-360.0, 360.0}, "deg", "turn to the left about up");
    visit.number("pitch_deg", self.pitch_deg, {-89.0, 89.0}, "deg", "-z end upward: a ramp that rises going forward");
    visit.number("reflectivity", self.reflectivity, {0.0, 1.0}, "1", "share of light sent back");
    visit.section("repeat", self.repeat, "copies at equal steps");
  }
};

struct CylinderConfig {
  std::string name = {};
  std::array<double, 3> center_m = {0.0, 0.0, 0.0};
  std::string axis = "y";
  double radius_m = 0.5;
  double length_m = 1.0;
  double reflectivity = 0.5;
  RepeatConfig repeat = {};

  void visit_fields(this auto& self, auto& visit) {
    visit.text("name", self.name, "for people");
    visit.vector("center_m", self.center_m, {-1000.0, 1000.0}, "m", "middle of the axis");
    visit.choice("axis", self.axis, {"x", "y", "z"}, "world axis that the cylinder's axis follows");
    visit.number("radius_m", self.radius_m, {0.001, 100.0}, "m", "radius");
    visit.number("length_m", self.length_m, {0.001, 1000.0}, "m", "end to end");
    visit.number("reflectivity", self.reflectivity, {0.0, 1.0}, "1", "share of light sent back");
    visit.section("repeat", self.repeat, "copies at equal steps");
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

[[nodiscard]] Plane to_plane(const PlaneConfig& config);

/// Every copy of every solid, boxes first, then cylinders and spheres.
[[nodiscard]] std::vector<Solid> to_solids(const std::vector<BoxConfig>& boxes,
                                           const std::vector<CylinderConfig>& cylinders,
                                           const std::vector<SphereConfig>& spheres);

}  // namespace ignis::sim
