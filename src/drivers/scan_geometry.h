// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "drivers/driver_config.h"
#include "drivers/packet_pairer.h"

namespace ignis::l1 {

/// A return in the sensor's own frame: origin at the centre of the mounting face, X away from the cable outlet, Z up.
struct SensorPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< [m]
  float intensity = 0.0F;                              ///< reflectivity 0..255
  int index = 0;                                       ///< place in the packet, 0..119
};

/// The returns of one packet within the range limits, by the vendor's published formula with the calibration that the
/// packet carries. Ranges are compared in single precision, as the vendor's library does.
[[nodiscard]] std::vector<SensorPoint> points_of(const PacketPair& packet, const DriverConfig& config);

/// Number of returns in the packet, whatever their range.
[[nodiscard]] int returns_of(const Distance& distance);

}  // namespace ignis::l1
