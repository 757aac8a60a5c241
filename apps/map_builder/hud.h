// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/pose.h"
#include "ignis/loop_result_t.hpp"
#include "ignis/map_status_t.hpp"
#include "ignis/scan_stats_t.hpp"
#include "ignis/state_t.hpp"
#include "map_builder/duration_stats.h"
#include "map_builder/process_table.h"
#include "map_builder/view_board.h"

namespace ignis {

struct StreamCounters;

/// What the head-up display shows: the newest message of each kind, and counts.
struct HudData {
  state_t state{};
  scan_stats_t scan{};
  loop_result_t loop{};
  map_status_t map{};
  bool has_state = false;
  bool has_scan = false;
  bool has_loop = false;
  Pose T_map_body;           ///< of the newest state
  double state_age_s = 0.0;  ///< [s] since the last LIO_STATE arrived
  std::int64_t scans_applied = 0;
  std::int64_t scans_rejected = 0;
  int loops_accepted = 0;
  int loops_withdrawn = 0;
  bool rebuilding = false;
  std::int64_t messages_received = 0;
  std::int64_t messages_lost = 0;
  std::int64_t messages_repeated = 0;  ///< parts of keyframes that were whole already
  std::int64_t refused_clouds = 0;
  std::int64_t refused_poses = 0;
  std::int64_t refused_points = 0;  ///< at poses that are sound
  std::int64_t refused_of_other_sessions = 0;
  std::int64_t keyframes_given_up = 0;  ///< their clouds never came
  std::string health;                   ///< state_text of this process
  std::vector<ProcessTable::Row> processes;
  std::array<double, 3> band_radii{};  ///< [m] windows of the levels
};

/// What the map's work costs.
struct MapBudget {
  DurationStats insertion;  ///< [ms] per scan
  DurationStats picture;    ///< [ms] per instant: pictures of all radii
  DurationStats rebuild;    ///< [ms] on its own thread
  std::size_t voxel_bytes = 0;
  std::size_t cloud_bytes = 0;
};

/// The text message {"type": "hud", ...} of docs/wire_format.md. Numbers that are not finite become null.
[[nodiscard]] std::string hud_json(const HudData& data);

/// The answer of GET /api/status.
[[nodiscard]] std::string status_json(const HudData& data, const MapBudget& budget, const StreamCounters& counters,
                                      const std::map<double, SharedPicture>& pictures, const std::string& loops);

}  // namespace ignis
