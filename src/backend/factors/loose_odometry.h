// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "backend/backend_config.h"
#include "backend/factors/information.h"

namespace ignis {

/// Whitening of the odometry between two keyframes of which neither scans nor IMU say anything.
[[nodiscard]] WhiteningRows loose_rows(const BackendConfig& config);

}  // namespace ignis
