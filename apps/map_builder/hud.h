// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "ignis/loop_result_t.hpp"
#include "ignis/map_status_t.hpp"
#include "ignis/scan_stats_t.hpp"
#include "ignis/state_t.hpp"

namespace ignis {

/// What the head-up display shows: the newest message of each kind, and counts.
struct HudData {
  state_t state{};
  scan_stats_t scan{};
  loop_result_t loop{};
  map_status_t map{};
  bool has_state = false;
  bool has_scan = false;
  bool has_loop = false;
  double state_age_s = 0.0;  ///< [s] since the last LIO_STATE arrived
  std::int64_t scans_applied = 0;
  std::int64_t scans_rejected = 0;
  int loops_accepted = 0;
  int loops_withdrawn = 0;
  bool rebuilding = false;
  std::int64_t messages_lost = 0;
  std::string health;                  ///< state_text of this process
  std::array<double, 3> band_radii{};  ///< [m] windows of the levels
};

/// The text message {"type": "hud", ...} of docs/wire_format.md. Numbers that are not finite become null.
[[nodiscard]] std::string hud_json(const HudData& data);

/// The answer of GET /api/status: the counts alone.
[[nodiscard]] std::string status_json(const HudData& data);

}  // namespace ignis
