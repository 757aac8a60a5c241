// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "common/config_fields.h"
#include "drivers/sim/mesh.h"

namespace ignis::sim {

/// A triangle mesh as a scene file places it: scaled, turned, moved.
struct MeshConfig {
  std::string name = {};
  std::string file = {};
  double scale = 1.0;
  std::array<double, 3> translation_m = {0.0, 0.0, 0.0};
  double yaw_deg = 0.0;
  double pitch_deg = 0.0;
  double reflectivity = 0.5;
  TriangleMesh mesh = {};  ///< what load_scene read from the file, already in the world frame

  void visit_fields(this auto& self, auto& visit) {
    visit.text("name", self.name, "for people");
    visit.text("file", self.file, "PLY or OBJ file, beside the scene file");
    visit.number("scale", self.scale, {1e-6, 1e6}, "1", "metres per unit of the file");
    visit.vector("translation_m", self.translation_m, {-1000.0, 1000.0}, "m", "where the file's origin goes");
    visit.number("yaw_deg", self.yaw_deg, {-360.0, 360.0}, "deg", "turn to the left about up");
    visit.number("pitch_deg", self.pitch_deg, {-180.0, 180.0}, "deg",
                 "turn about the mesh's x before the yaw, -z end upward; -90 stands a file with Z up upright");
    visit.number("reflectivity", self.reflectivity, {0.0, 1.0}, "1", "share of light sent back");
  }
};

/// A mesh of a file in the place, attitude and size of its configuration.
[[nodiscard]] TriangleMesh placed(const MeshConfig& config, TriangleMesh mesh);

}  // namespace ignis::sim
