// SPDX-License-Identifier: Apache-2.0
#include "drivers/driver_config.h"

#include "drivers/udp_port.h"

namespace ignis {

void DriverConfig::check(config::Offences& offences, const std::string& path) const {
  if (l1::is_udp(port) && !l1::parse_udp_address(port)) {
    offences.push_back({path + ".port", port, std::string(l1::kUdpForm)});
  }
  if (range_min_m < range_max_m) return;
  offences.push_back(
      {path + ".range_max_m", std::format("{}", range_max_m), std::format("more than range_min_m = {}", range_min_m)});
}

Extrinsics l1_extrinsics() {
  Extrinsics extrinsics;
  extrinsics.lidar.pitch_deg = -45.0;
  extrinsics.imu.pitch_deg = -45.0;
  const Eigen::Vector3d imu_in_lidar(-0.007698, -0.014655, 0.00667);
  const Eigen::Vector3d imu_in_body = extrinsics.lidar.T_body_sensor() * imu_in_lidar;
  extrinsics.imu.translation_m = {imu_in_body.x(), imu_in_body.y(), imu_in_body.z()};
  return extrinsics;
}

}  // namespace ignis
