// SPDX-License-Identifier: Apache-2.0
#include "scene_summary.h"

#include "common/config_json.h"

namespace ignis {

std::string summary(const sim::SceneConfig& scene) {
  const sim::Trajectory drive(scene.trajectory);
  const config::Json json = {
      {"description", scene.description},
      {"solids",
       {{"planes", scene.planes.size()},
        {"boxes", scene.boxes.size()},
        {"cylinders", scene.cylinders.size()},
        {"spheres", scene.spheres.size()}}},
      {"drive", {{"duration_s", drive.duration()}, {"length_m", drive.length()}}},
      {"trajectory", config::Printer::print(scene.trajectory)},
      {"imu", config::Printer::print(scene.imu)},
      {"lidar", config::Printer::print(scene.lidar)},
  };
  return json.dump(2) + '\n';
}

}  // namespace ignis
