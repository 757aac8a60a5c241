// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/measurements.h"
#include "drivers/driver_config.h"
#include "drivers/scan_geometry.h"

namespace ignis::l1 {

/// A return in the body frame of its own instant.
struct BodyPoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< [m]
  float intensity = 0.0F;                              ///< reflectivity 0..255
  int index = 0;                                       ///< place in the packet, 0..119
};

/// Undoes the mount: from sensor axes to the body frame, without the points on the vehicle itself.
class BodyMount {
 public:
  BodyMount(const Extrinsics& extrinsics, std::vector<OwnStructureBox> own_structure);

  /// The points that are not on the vehicle's own structure.
  [[nodiscard]] std::vector<BodyPoint> to_body(const std::vector<SensorPoint>& points) const;

  /// Rate and specific force at the body origin, body axes. The force is moved from the inertial unit by
  /// f_body = R f_imu - w x (w x r); the term of the angular acceleration is left out, since differentiating the
  /// gyroscope adds more noise than the 2 cm arm of an L1 is worth.
  [[nodiscard]] ImuSample to_body(const Eigen::Vector3d& gyro_imu, const Eigen::Vector3d& accel_imu) const;

 private:
  Pose T_body_lidar_;
  Pose T_body_imu_;
  std::vector<OwnStructureBox> own_structure_;
};

}  // namespace ignis::l1
