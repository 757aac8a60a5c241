// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim/solid_config.h"

#include <cmath>
#include <format>
#include <numbers>

#include "common/frames.h"

namespace ignis::sim {
namespace {

constexpr int kMostCopies = 100000;

Eigen::Vector3d to_vector(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

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

void append_copies(std::vector<Solid>& solids, const Solid& first, const RepeatConfig& repeat) {
  const Eigen::Vector3d step = to_vector(repeat.step_m);
  for (int i = 0; i < repeat.count[0]; ++i) {
    for (int j = 0; j < repeat.count[1]; ++j) {
      for (int k = 0; k < repeat.count[2]; ++k) {
        Solid copy = first;
        copy.center += Eigen::Vector3d(i, j, k).cwiseProduct(step);
        solids.push_back(copy);
      }
    }
  }
}

}  // namespace

void RepeatConfig::check(config::Offences& offences, const std::string& path) const {
  const std::string shown = std::format("[{}, {}, {}]", count[0], count[1], count[2]);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (count[axis] != std::floor(count[axis])) {
      offences.push_back({path + ".count", shown, "three whole numbers"});
    } else if (count[axis] > 1.0 && step_m[axis] == 0.0) {
      offences.push_back({std::format("{}.step_m[{}]", path, axis), "0", "not 0 along an axis with several copies"});
    }
  }
  if (count[0] * count[1] * count[2] > kMostCopies) {
    offences.push_back({path + ".count", shown, std::format("at most {} copies together", kMostCopies)});
  }
}

void PlaneConfig::check(config::Offences& offences, const std::string& path) const {
  if (to_vector(normal).norm() < 1e-6) {
    offences.push_back({path + ".normal", "[0, 0, 0]", "a direction, not all zero"});
  }
}

Plane to_plane(const PlaneConfig& config) {
  return {to_vector(config.normal).normalized(), config.offset_m, config.reflectivity};
}

std::vector<Solid> to_solids(const std::vector<BoxConfig>& boxes, const std::vector<CylinderConfig>& cylinders,
                             const std::vector<SphereConfig>& spheres) {
  std::vector<Solid> solids;
  for (const BoxConfig& box : boxes) append_copies(solids, to_solid(box), box.repeat);
  for (const CylinderConfig& cylinder : cylinders) append_copies(solids, to_solid(cylinder), cylinder.repeat);
  for (const SphereConfig& sphere : spheres) solids.push_back(to_solid(sphere));
  return solids;
}

}  // namespace ignis::sim
