// SPDX-License-Identifier: Apache-2.0
#include "drivers/body_mount.h"

#include <algorithm>
#include <utility>

namespace ignis::l1 {

namespace {

bool contains(const OwnStructureBox& box, const Eigen::Vector3d& point) {
  const Eigen::Map<const Eigen::Array3d> min(box.min_m.data());
  const Eigen::Map<const Eigen::Array3d> max(box.max_m.data());
  return (point.array() >= min).all() && (point.array() <= max).all();
}

}  // namespace

BodyMount::BodyMount(const Extrinsics& extrinsics, std::vector<OwnStructureBox> own_structure)
    : T_body_lidar_(extrinsics.lidar.T_body_sensor()),
      T_body_imu_(extrinsics.imu.T_body_sensor()),
      own_structure_(std::move(own_structure)) {}

std::vector<BodyPoint> BodyMount::to_body(const std::vector<SensorPoint>& points) const {
  std::vector<BodyPoint> accepted;
  accepted.reserve(points.size());
  for (const SensorPoint& point : points) {
    const Eigen::Vector3d p_body = T_body_lidar_ * point.position;
    const bool on_vehicle =
        std::ranges::any_of(own_structure_, [&](const OwnStructureBox& box) { return contains(box, p_body); });
    if (!on_vehicle) accepted.push_back({p_body.cast<float>(), point.intensity, point.index});
  }
  return accepted;
}

ImuSample BodyMount::to_body(const Eigen::Vector3d& gyro_imu, const Eigen::Vector3d& accel_imu) const {
  ImuSample sample;
  sample.gyro = T_body_imu_.rotation * gyro_imu;
  const Eigen::Vector3d centripetal = sample.gyro.cross(sample.gyro.cross(T_body_imu_.translation));
  sample.accel = T_body_imu_.rotation * accel_imu - centripetal;
  return sample;
}

}  // namespace ignis::l1
