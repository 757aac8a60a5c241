// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "common/time.h"

/// What the sensor measures, already in the body frame (X right, Y up, -Z forward, origin at the body origin).
namespace ignis {

struct ImuSample {
  Utime utime = 0;                                  ///< [us]
  std::int32_t sequence = 0;                        ///< +1 per sample of one sender
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero();   ///< [rad/s]
  Eigen::Vector3d accel = Eigen::Vector3d::Zero();  ///< [m/s^2] specific force: (0, +g, 0) at rest
  bool saturated = false;                           ///< an axis stands at the sensor's limit
};

struct ScanPoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< [m] body frame of the point's own instant
  float intensity = 0.0F;                              ///< reflectivity 0..255
  std::int32_t dt_us = 0;                              ///< [us] instant of the point minus the scan's utime
};

struct Scan {
  Utime utime = 0;                   ///< [us] instant of the first point
  std::int32_t sequence = 0;         ///< +1 per scan of one sender
  std::int32_t duration_us = 0;      ///< [us] first to last point
  std::int32_t missing_packets = 0;  ///< sensor packets known to be absent
  std::vector<ScanPoint> points;

  [[nodiscard]] Utime end_utime() const { return utime + duration_us; }
};

/// A point whose instant no longer matters: deskewed, or part of a map.
struct CloudPoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< [m]
  float intensity = 0.0F;                              ///< reflectivity 0..255
};

}  // namespace ignis
