// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "drivers/driver_config.h"
#include "runtime/application.h"

namespace ignis {

struct DecodeFiles {
  std::filesystem::path capture;
  std::filesystem::path points;  ///< empty: none
  std::filesystem::path imu;     ///< empty: none
};

/// Writes what is in a recorded byte stream as tables. Points: scan, j, x, y, z, intensity in the LiDAR frame [m],
/// every return of at most 50 m and no other filter; scan counts AUX/DISTANCE pairs from 0 by the sensor's own
/// numbering, so that a lost pair leaves a hole. IMU: packet_id, quaternion w x y z, angular rate [rad/s] and specific
/// force [m/s^2] as on the wire. Damage is told on the error stream and by the exit code kInputDamaged.
[[nodiscard]] runtime::ExitCode decode_capture(const DecodeFiles& files, const DriverConfig& config);

}  // namespace ignis
