// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/scene_config.h"

#include <numbers>

#include "common/config_json.h"
#include "common/frames.h"

namespace ignis::sim {
namespace {

Eigen::Vector3d to_vector(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

SceneConfig load_one(const std::filesystem::path& file) {
  const config::Json json = config::read_json(file);
  try {
    return config::load<SceneConfig>(json);
  } catch (const config::ConfigError& error) {
    throw config::ConfigError("scene " + file.string() + ": " + error.what());
  }
}

template <class T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

Solid to_solid(const BoxConfig& box) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const Eigen::Quaterniond q_world_box =
      frames::from_yaw_pitch_roll({.yaw = box.yaw_deg * kDegree, .pitch = box.pitch_deg * kDegree, .roll = 0.0});
  return {Solid::Shape::kBox, q_world_box.toRotationMatrix(), to_vector(box.center_m), 0.5 * to_vector(box.size_m),
          box.reflectivity};
}

Solid to_solid(const CylinderConfig& cylinder) {
  // The local axis is Y; a cyclic permutation of the axes is a rotation.
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  if (cylinder.axis == "x") R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  if (cylinder.axis == "z") R << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return {Solid::Shape::kCylinder,
          R,
          to_vector(cylinder.center_m),
          {cylinder.radius_m, 0.5 * cylinder.length_m, cylinder.radius_m},
          cylinder.reflectivity};
}

Solid to_solid(const SphereConfig& sphere) {
  return {Solid::Shape::kSphere, Eigen::Matrix3d::Identity(), to_vector(sphere.center_m),
          Eigen::Vector3d::Constant(sphere.radius_m), sphere.reflectivity};
}

}  // namespace

void PlaneConfig::check(config::Offences& offences, const std::string& path) const {
  if (to_vector(normal).norm() < 1e-6) {
    offences.push_back({path + ".normal", "[0, 0, 0]", "a direction, not all zero"});
  }
}

SceneConfig load_scene(const std::filesystem::path& file) {
  SceneConfig scene = load_one(file);
  if (scene.geometry.empty()) return scene;
  const SceneConfig source = load_one(file.parent_path() / scene.geometry);
  if (!source.geometry.empty()) {
    throw config::ConfigError("scene " + file.string() + ": geometry = \"" + scene.geometry +
                              "\" takes its own geometry from \"" + source.geometry + "\"; name that file instead");
  }
  append(scene.planes, source.planes);
  append(scene.boxes, source.boxes);
  append(scene.cylinders, source.cylinders);
  append(scene.spheres, source.spheres);
  return scene;
}

RayScene make_ray_scene(const SceneConfig& scene) {
  std::vector<Plane> planes;
  for (const PlaneConfig& plane : scene.planes) {
    planes.push_back({to_vector(plane.normal).normalized(), plane.offset_m, plane.reflectivity});
  }
  std::vector<Solid> solids;
  for (const BoxConfig& box : scene.boxes) solids.push_back(to_solid(box));
  for (const CylinderConfig& cylinder : scene.cylinders) solids.push_back(to_solid(cylinder));
  for (const SphereConfig& sphere : scene.spheres) solids.push_back(to_solid(sphere));
  return {std::move(planes), std::move(solids)};
}

}  // namespace ignis::sim
