// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/mesh_config.h"

#include <numbers>

#include "common/frames.h"

namespace ignis::sim {

TriangleMesh placed(const MeshConfig& config, TriangleMesh mesh) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const Eigen::Matrix3d R_world_mesh =
      frames::from_yaw_pitch_roll({.yaw = config.yaw_deg * kDegree, .pitch = config.pitch_deg * kDegree, .roll = 0.0})
          .toRotationMatrix();
  const Eigen::Vector3d translation(config.translation_m[0], config.translation_m[1], config.translation_m[2]);
  for (Eigen::Vector3f& vertex : mesh.vertices) {
    vertex = (config.scale * (R_world_mesh * vertex.cast<double>()) + translation).cast<float>();
  }
  mesh.reflectivity = config.reflectivity;
  return mesh;
}

}  // namespace ignis::sim
