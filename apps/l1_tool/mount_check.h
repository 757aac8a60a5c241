// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "common/extrinsics.h"
#include "drivers/driver_config.h"
#include "runtime/application.h"

namespace ignis {

struct MountCheckOptions {
  double seconds = 5.0;           ///< of data at rest
  std::filesystem::path capture;  ///< empty: the live sensor
};

/// Tells, for a vehicle that stands still on level ground, the pitch and roll of the mount that gravity and the floor
/// imply, beside the configured ones, and whether units and signs of the inertial unit are right. kFailed when
/// something is wrong, so that a check list can stop.
[[nodiscard]] runtime::ExitCode check_mount(const MountCheckOptions& options, const DriverConfig& driver,
                                            const Extrinsics& extrinsics);

}  // namespace ignis
