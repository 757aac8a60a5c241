// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "common/measurements.h"
#include "common/nav_state.h"
#include "frontend/frontend_config.h"

namespace ignis {

/// Moves every point of a scan to the body frame at the scan's END, by integrating the IMU backward from the state
/// there. gravity_m: [m/s^2].
///
/// `samples` are IMU samples in time order; the last one must be at or after the scan's end. Before the first and after
/// the last sample the nearest one holds. Instants outside the scan are clamped into it. The velocity of the state may
/// be wrong or unknown (zero): the result is then compensated for rotation alone, and calling again with the corrected
/// state gives the better cloud.
[[nodiscard]] std::vector<CloudPoint> deskew(const Scan& scan, const NavState& state_at_end,
                                             std::span<const ImuSample> samples, double gravity_m);

}  // namespace ignis
