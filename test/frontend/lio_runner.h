// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "frontend/lio.h"
#include "frontend/synthetic_world.h"

/// Feeds a simulated drive to the front end and compares with the truth.
namespace ignis::test {

struct LioRun {
  std::vector<ScanResult> scans;
  std::vector<NavState> states;  ///< one per accepted IMU sample
  LioStatus status;
};

/// Each scan is handed over when the IMU stream has passed its end by `scan_delay_s`.
[[nodiscard]] LioRun run_lio(const FrontendConfig& config, const Drive& drive, double scan_delay_s = 0.002);

/// Seconds since the drive's first IMU sample.
[[nodiscard]] double drive_seconds(const Drive& drive, Utime utime);

/// [m] Root mean square position error over all scans with a state, after SE(3) alignment.
[[nodiscard]] double aligned_error(const LioRun& run, const Drive& drive);

/// [m] Position error at the last scan, in the frame of the start.
[[nodiscard]] double end_error(const LioRun& run, const Drive& drive);

/// [m] The largest error of a pose that was reported as OK, the first pose laid on the true one; negative when none
/// was.
[[nodiscard]] double worst_silent_error(const LioRun& run, const Drive& drive);

/// Squared errors of the pose over what the published covariance says, per degree of freedom.
struct PoseNees {
  double position = 0.0;
  double attitude = 0.0;
};

/// Mean over the scans that were applied.
[[nodiscard]] PoseNees pose_nees(const LioRun& run, const Drive& drive);

[[nodiscard]] int count(const LioRun& run, ScanReason reason);

/// The front end of config/ignis8_tuned.json.
[[nodiscard]] FrontendConfig tuned_config();

}  // namespace ignis::test
