// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "common/config_fields.h"
#include "common/pose.h"

namespace ignis {

/// How one sensor sits on the vehicle: which way its axes are named, how it is turned, and where it is.
struct Mount {
  /// Axes of the sensor when it is mounted level and facing forward.
  std::string axes = "forward_left_up";
  double yaw_deg = 0.0;    ///< turn to the left about up
  double pitch_deg = 0.0;  ///< nose up about right; a sensor tilted 45 degrees forward has -45
  double roll_deg = 0.0;   ///< right side down about forward
  std::array<double, 3> translation_m = {0.0, 0.0, 0.0};  ///< sensor origin in the body frame

  void visit_fields(this auto& self, auto& visit) {
    visit.choice("axes", self.axes, {"forward_left_up", "right_up_back"}, "axes of the sensor when level");
    visit.number("yaw_deg", self.yaw_deg, {-360.0, 360.0}, "deg", "turn to the left about up");
    visit.number("pitch_deg", self.pitch_deg, {-360.0, 360.0}, "deg", "nose up about right");
    visit.number("roll_deg", self.roll_deg, {-360.0, 360.0}, "deg", "right side down about forward");
    visit.vector("translation_m", self.translation_m, {-20.0, 20.0}, "m", "sensor origin in the body frame");
  }

  /// Takes sensor coordinates to body coordinates.
  [[nodiscard]] Pose T_body_sensor() const;
};

/// Mounts of both sensors. Everything on the bus is already in the body frame: drivers and importers apply these.
struct Extrinsics {
  Mount lidar;
  Mount imu;

  void visit_fields(this auto& self, auto& visit) {
    visit.section("lidar", self.lidar, "mount of the LiDAR");
    visit.section("imu", self.imu, "mount of the inertial unit");
  }
};

}  // namespace ignis
