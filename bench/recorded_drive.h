// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>
#include <vector>

#include "common/measurements.h"
#include "common/nav_state.h"
#include "frontend/frontend_config.h"
#include "frontend/local_map/local_map.h"

/// What the micro-benchmarks of the front end work on: the first seconds of a simulated drive, and the moment of its
/// last scan. Both frames, odom and world, are the same here, and the IMU is perfect, so that nothing but the code
/// under test decides the result.
namespace ignis::bench {

struct RecordedDrive {
  FrontendConfig config;
  std::vector<ImuSample> imu = {};
  std::vector<Scan> scans = {};
  std::vector<NavState> states = {};  ///< true, at each scan's end
};

/// "l1": the battery hall by an L1 with config/ignis8_tuned.json. "spinning128": the warehouse by 128 beams, 130,000
/// points a scan, with config/spinning.json. Simulated on the first call, kept for the others.
[[nodiscard]] const RecordedDrive& recorded_drive(std::string_view sensor);

/// The map of all scans but the last, each deskewed and inserted at its true pose.
[[nodiscard]] LocalMap map_before_last(const RecordedDrive& drive);

/// The last scan, deskewed and in range, and what of it goes into matching.
[[nodiscard]] std::vector<CloudPoint> last_cloud(const RecordedDrive& drive);
[[nodiscard]] std::vector<Eigen::Vector3f> last_thinned(const RecordedDrive& drive);

}  // namespace ignis::bench
